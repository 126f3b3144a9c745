//! A real Chromium, driven through chromedriver.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use fantoccini::{Client, ClientBuilder, Locator};
use hyper_util::client::legacy::connect::HttpConnector;
use serde_json::{Value, json};

use crate::served::{PATIENCE, request};

/// Screenshots are kept in this folder, if it is named.
const PICTURES: &str = "FIELDGAP_SCREENSHOTS";

fn program(names: &[&str]) -> Option<PathBuf> {
    let paths = std::env::var_os("PATH")?;
    std::env::split_paths(&paths)
        .flat_map(|folder| names.iter().map(move |name| folder.join(name)))
        .find(|path| path.is_file())
}

/// A window is never this narrow; a phone is.
const NARROWEST_WINDOW: u32 = 500;

pub struct Driver {
    process: Child,
    port: u16,
    browser: PathBuf,
}

impl Driver {
    /// `None`, said, where one of them is not installed.
    pub fn begin() -> Option<Self> {
        let driver = program(&["chromedriver"]);
        let browser = program(&["chromium", "chromium-browser", "google-chrome"]);
        let (Some(driver), Some(browser)) = (driver, browser) else {
            eprintln!("skipped: chromium or chromedriver is not installed");
            return None;
        };
        let mut process =
            Command::new(driver).arg("--port=0").stdout(Stdio::piped()).spawn().expect("it starts");
        let mut lines = BufReader::new(process.stdout.take().expect("piped")).lines();
        let port = lines.find_map(|line| {
            let line = line.expect("text");
            line.strip_suffix('.')?.rsplit_once("successfully on port ")?.1.parse().ok()
        });
        Some(Self { process, port: port.expect("a port"), browser })
    }

    /// A window, or the screen of a phone.
    pub async fn open(&self, wide: u32, high: u32) -> Client {
        let mut options = json!({
            "binary": self.browser,
            "args": ["--headless=new", "--no-sandbox", "--disable-gpu", format!("--window-size={wide},{high}")],
        });
        if wide < NARROWEST_WINDOW {
            options["mobileEmulation"] = json!({"deviceMetrics": {"width": wide, "height": high, "pixelRatio": 2.0, "touch": true}});
        }
        // The certificate of the server is its own; people compare its fingerprint.
        let wanted = json!({"goog:chromeOptions": options, "acceptInsecureCerts": true});
        let Value::Object(capabilities) = wanted else { unreachable!() };
        let address = format!("http://127.0.0.1:{}", self.port);
        let mut builder = ClientBuilder::new(HttpConnector::new());
        builder.capabilities(capabilities).connect(&address).await.expect("a browser")
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

pub async fn click(page: &Client, id: &str) {
    page.find(Locator::Id(id)).await.expect("it is there").click().await.expect("clicked");
}

pub async fn script(page: &Client, script: &str) -> Value {
    page.execute(script, vec![]).await.expect("it runs")
}

/// Waits until a script gives true. What it asks of may not be on the page yet: then it is not true.
pub async fn until(page: &Client, wanted: &str) {
    let begun = Instant::now();
    let asked = format!("try {{ return Boolean({wanted}) }} catch {{ return false }}");
    while script(page, &asked).await != Value::Bool(true) {
        if begun.elapsed() > PATIENCE {
            let seen = script(page, "return document.body.innerText").await;
            panic!("never {wanted}: {seen}");
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

pub async fn picture(page: &Client, name: &str) {
    if let Some(folder) = std::env::var_os(PICTURES) {
        let png = page.screenshot().await.expect("a picture");
        std::fs::write(Path::new(&folder).join(format!("{name}.png")), png).expect("written");
    }
}

pub async fn logged_in(page: &Client, link: &str) {
    page.goto(link).await.expect("it opens");
    until(page, "!document.getElementById('stop').disabled && document.getElementById('controls').textContent").await;
    let address = page.current_url().await.expect("an address");
    assert!(!address.as_str().contains("link="), "the secret stays in the address");
}

/// A command of Chromium's own, which WebDriver has no word for.
pub async fn in_developer_tools(driver: &Driver, page: &Client, command: &str, parameters: Value) {
    to_driver(driver, page, "goog/cdp/execute", json!({"cmd": command, "params": parameters}))
        .await;
}

/// A command to chromedriver that other drivers do not know.
pub async fn to_driver(driver: &Driver, page: &Client, command: &str, body: Value) {
    let session = page.session_id().await.expect("an answer").expect("a session");
    let (path, body) = (format!("/session/{session}/{command}"), body.to_string());
    let port = driver.port;
    let headers = [("Content-Type", "application/json")];
    let (status, _, answer) =
        tokio::task::spawn_blocking(move || request(port, "POST", &path, &headers, &body))
            .await
            .expect("no panic");
    assert_eq!(status, 200, "{answer}");
}
