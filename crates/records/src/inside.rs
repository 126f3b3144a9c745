//! What a record may refer to: only what lies in its own folder. A record may come from somebody else.

use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use fieldgap_input::Fault;

/// What to do about a way out.
const REMEDY: &str =
    "copy the file into the folder of the record, in place of the link or the path";

/// Whether `path`, relative to `folder`, stays in it also behind links.
pub fn is_inside(folder: &Path, path: &Path) -> bool {
    let plain = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if !path.components().all(plain) {
        return false;
    }
    let path = folder.join(path);
    // A file that does not exist is judged by the nearest folder that does.
    let there = path.ancestors().find(|path| fs::symlink_metadata(path).is_ok());
    there.is_none_or(|there| leads_inside(folder, there))
}

/// Checks that no link in a record, at any depth, leads out of it.
///
/// # Errors
/// A [`Fault`] that names the first such link; or that the folder cannot be read.
pub fn without_ways_out(folder: &Path) -> Result<(), Fault> {
    let mut folders = vec![folder.to_owned()];
    while let Some(current) = folders.pop() {
        let entries = match fs::read_dir(&current) {
            Ok(entries) => entries,
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(unreadable(&current, &error)),
        };
        for entry in entries {
            let entry = entry.map_err(|error| unreadable(&current, &error))?;
            let kind = entry.file_type().map_err(|error| unreadable(&entry.path(), &error))?;
            if kind.is_dir() {
                folders.push(entry.path());
            } else if kind.is_symlink() && !leads_inside(folder, &entry.path()) {
                let problem = "it is a link that leads out of the record";
                return Err(Fault::of_file(&entry.path(), problem, REMEDY));
            }
        }
    }
    Ok(())
}

/// The fault of a path that leads out of a record.
pub fn leads_out(path: &str) -> (String, &'static str) {
    (format!("`{path}` leads out of the record"), REMEDY)
}

fn unreadable(path: &Path, error: &io::Error) -> Fault {
    Fault::of_file(path, format!("cannot be read: {error}"), "check the permissions of the folder")
}

/// Whether an existing file, behind all links, is in a folder; a link to nothing is not.
fn leads_inside(folder: &Path, path: &Path) -> bool {
    match (fs::canonicalize(or_here(folder)), fs::canonicalize(or_here(path))) {
        (Ok(folder), Ok(path)) => path.starts_with(folder),
        _ => false,
    }
}

fn or_here(path: &Path) -> PathBuf {
    if path.as_os_str().is_empty() { PathBuf::from(".") } else { path.to_owned() }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn paths_and_links_that_lead_out_are_recognised() {
        let home = tempfile::tempdir().expect("a folder");
        let folder = home.path().join("record");
        fs::create_dir_all(folder.join("wire")).expect("created");
        fs::write(home.path().join("secret"), "").expect("written");
        fs::write(folder.join("inside.csv"), "").expect("written");
        for inside in ["inside.csv", "./inside.csv", "wire/inside", "not/there.csv"] {
            assert!(is_inside(&folder, Path::new(inside)), "{inside}");
        }
        let absolute = home.path().join("record/inside.csv");
        for outside in ["../secret", "wire/../../secret", &absolute.to_string_lossy()] {
            assert!(!is_inside(&folder, Path::new(outside)), "{outside}");
        }
        symlink("../inside.csv", folder.join("wire/near")).expect("linked");
        without_ways_out(&folder).expect("it leads inside");
        for target in ["../../secret", "/nowhere/at/all"] {
            symlink(target, folder.join("wire/far")).expect("linked");
            assert!(!is_inside(&folder, Path::new("wire/far")));
            let fault = without_ways_out(&folder).expect_err("it leads out");
            assert_eq!(fault.path(), folder.join("wire/far"));
            fs::remove_file(folder.join("wire/far")).expect("removed");
        }
        symlink(home.path(), folder.join("out")).expect("linked");
        assert!(!is_inside(&folder, Path::new("out/new.csv")));
        assert!(without_ways_out(&folder).is_err());
    }

    #[test]
    fn a_record_behind_a_link_is_a_record() {
        let home = tempfile::tempdir().expect("a folder");
        fs::create_dir(home.path().join("record")).expect("created");
        symlink("record", home.path().join("latest")).expect("linked");
        let folder = home.path().join("latest");
        fs::write(folder.join("samples.csv"), "").expect("written");
        assert!(is_inside(&folder, Path::new("samples.csv")));
        without_ways_out(&folder).expect("nothing leads out");
    }
}
