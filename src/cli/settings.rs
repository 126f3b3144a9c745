//! The folder of a user's settings.

use std::path::PathBuf;

/// `$XDG_CONFIG_HOME/fieldgap`, or `~/.config/fieldgap`; `None` where neither variable is set.
pub(super) fn settings_folder() -> Option<PathBuf> {
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    let settings = set("XDG_CONFIG_HOME")
        .map(PathBuf::from)
        .or_else(|| set("HOME").map(|home| PathBuf::from(home).join(".config")))?;
    settings.is_absolute().then(|| settings.join("fieldgap"))
}
