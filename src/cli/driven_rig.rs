//! The rig file that drives the ports of a virtual rig, and stable names for these ports.

use std::fs;
use std::path::{Path, PathBuf};

use miette::{Context, IntoDiagnostic, miette};
use toml_edit::{DocumentMut, Item, value};

use fieldgap_rig::Ports;

/// A device: the section of the rig file, and the name of its link.
const DEVICES: [(&str, &str); 4] = [
    ("motion", "robot"),
    ("receiver", "receiver"),
    ("focus_array", "array"),
    ("environment", "environment"),
];

fn port_of<'p>(ports: &'p mut Ports, section: &str) -> Option<&'p mut String> {
    match section {
        "motion" => ports.motion.as_mut(),
        "receiver" => ports.receiver.as_mut(),
        "focus_array" => ports.focus_array.as_mut(),
        _ => ports.environment.as_mut(),
    }
}

/// Links in a folder to the ports, `robot`, `receiver`, `array` and `environment`; they are removed at the end. The ports become the links.
pub(super) struct Links(Vec<PathBuf>);

impl Links {
    /// Makes the links. One that an earlier virtual rig left is replaced; another file is not.
    ///
    /// # Errors
    /// A link cannot be made.
    pub(super) fn make(folder: &Path, ports: &mut Ports) -> miette::Result<Self> {
        fs::create_dir_all(folder).into_diagnostic()?;
        let folder = fs::canonicalize(folder).into_diagnostic()?;
        let mut links = Self(Vec::new());
        for (section, name) in DEVICES {
            let Some(port) = port_of(ports, section) else { continue };
            let link = folder.join(name);
            if link.is_symlink() {
                fs::remove_file(&link).into_diagnostic()?;
            }
            std::os::unix::fs::symlink(&*port, &link)
                .into_diagnostic()
                .wrap_err_with(|| format!("{} cannot be made a link", link.display()))?;
            *port = link.display().to_string();
            links.0.push(link);
        }
        Ok(links)
    }
}

impl Drop for Links {
    fn drop(&mut self) {
        for link in &self.0 {
            let _ = fs::remove_file(link);
        }
    }
}

/// Writes the rig file `from`, without `[virtual]` and with the ports of the virtual devices, as the new file `to` in the same folder.
///
/// # Errors
/// The folder is another one, whose paths would lead elsewhere; the file exists; or it cannot be written.
pub(super) fn write_rig(from: &Path, to: &Path, ports: &Ports) -> miette::Result<()> {
    let folder = |path: &Path| path.parent().map(Path::to_owned).unwrap_or_default();
    if folder(from) != folder(to) {
        return Err(miette!(
            help = "name a file beside the rig file, because its paths are relative to it",
            "{} is in another folder than {}",
            to.display(),
            from.display()
        ));
    }
    let text = fs::read_to_string(from).into_diagnostic()?;
    let driving = driving(&text, ports.clone())?;
    let file = fs::OpenOptions::new().write(true).create_new(true).open(to);
    file.and_then(|mut file| std::io::Write::write_all(&mut file, driving.as_bytes()))
        .into_diagnostic()
        .wrap_err_with(|| format!("{} cannot be written", to.display()))
}

/// A rig file without `[virtual]`, its devices at these ports.
fn driving(text: &str, mut ports: Ports) -> miette::Result<String> {
    let mut document: DocumentMut = text.parse().into_diagnostic()?;
    document.remove("virtual");
    for (section, _) in DEVICES {
        let Some(port) = port_of(&mut ports, section) else { continue };
        let section = document.get_mut(section).and_then(Item::as_table_like_mut);
        // Beside the travel, the driver is the one table of a section; keep-out boxes are an array of tables.
        let driver = section.and_then(|section| {
            let mut entries = section.iter_mut();
            let driver = entries.find(|(key, item)| *key != "travel_mm" && item.is_table_like());
            driver.map(|(_, item)| item)
        });
        if let Some(driver) = driver.and_then(Item::as_table_like_mut) {
            driver.insert("port", value(port.as_str()));
        }
    }
    Ok(document.to_string())
}
