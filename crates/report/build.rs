//! Packs the script of Plotly, so that the page of interactive maps holds it and works without a network.

use std::io::Write;
use std::path::Path;

use flate2::Compression;
use flate2::write::GzEncoder;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    // The crate gives its scripts as HTML elements; the first is Plotly, the second draws formulas and is not used.
    let elements = plotly::Plot::offline_js_sources();
    let script = elements
        .split_once('>')
        .and_then(|(_, rest)| rest.split_once("</script>"))
        .map(|(script, _)| script)
        .filter(|script| script.contains("plotly.js"))
        .ok_or("the plotly crate no longer gives the script as the first element")?;
    let out = std::env::var("OUT_DIR")?;
    let file = std::fs::File::create(Path::new(&out).join("plotly.js.gz"))?;
    let mut packed = GzEncoder::new(file, Compression::best());
    packed.write_all(script.as_bytes())?;
    packed.finish()?;
    Ok(())
}
