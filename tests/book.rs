//! The pages as a book: `SUMMARY.md` lists each once, and links lead to files and headings that exist.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The pages in `docs`.
fn pages() -> Vec<PathBuf> {
    std::fs::read_dir(repository().join("docs"))
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|ending| ending == "md"))
        .collect()
}

/// The targets of the links and pictures of a page outside of its code, each with its line.
fn links(markdown: &str) -> Vec<(usize, String)> {
    let mut links = Vec::new();
    let mut in_fence = false;
    for (number, line) in (1..).zip(markdown.lines()) {
        if line.starts_with("```") {
            in_fence = !in_fence;
        } else if !in_fence {
            let targets = line.split("](").skip(1).filter_map(|rest| rest.split(')').next());
            links.extend(targets.map(|target| (number, target.to_owned())));
        }
    }
    links
}

/// The anchors of a page's headings, as GitHub and mdBook form them.
fn anchors(markdown: &str) -> Vec<String> {
    let mut anchors: Vec<String> = Vec::new();
    let mut in_fence = false;
    for line in markdown.lines() {
        if line.starts_with("```") {
            in_fence = !in_fence;
        } else if !in_fence && line.starts_with('#') {
            let heading = line.trim_start_matches('#').trim().to_lowercase();
            let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
            anchors.push(kept.map(|c| if c == ' ' { '-' } else { c }).collect());
        }
    }
    anchors
}

/// What is wrong with a link of a page.
fn fault(page: &Path, target: &str) -> Option<&'static str> {
    if target.starts_with("http://") || target.starts_with("https://") {
        return None;
    }
    let (file, anchor) = match target.split_once('#') {
        Some((file, anchor)) => (file, Some(anchor)),
        None => (target, None),
    };
    let path = match file {
        "" => page.to_owned(),
        file => page.parent().expect("a folder").join(file),
    };
    if !path.exists() {
        return Some("there is no such file");
    }
    let is_page = path.extension().is_some_and(|ending| ending == "md");
    match anchor {
        Some(anchor) if is_page && !anchors(&text(&path)).iter().any(|known| known == anchor) => {
            Some("there is no such heading")
        }
        _ => None,
    }
}

#[test]
fn the_summary_lists_every_page_once() {
    let docs = repository().join("docs");
    let mut listed: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for (_, target) in links(&text(&docs.join("SUMMARY.md"))) {
        *listed.entry(docs.join(target)).or_default() += 1;
    }
    for page in pages() {
        let is_summary = page.ends_with("SUMMARY.md");
        assert_eq!(
            listed.get(&page).copied().unwrap_or(0),
            usize::from(!is_summary),
            "{}",
            page.display()
        );
    }
}

#[test]
fn every_link_leads_somewhere() {
    let mut wrong = Vec::new();
    let top =
        ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "python/README.md"];
    for page in pages().into_iter().chain(top.map(|page| repository().join(page))) {
        for (line, target) in links(&text(&page)) {
            if let Some(why) = fault(&page, &target) {
                wrong.push(format!("{}:{line}: {target}: {why}", page.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn wrong_links_are_found() {
    let page = repository().join("docs/README.md");
    assert_eq!(fault(&page, "nowhere.md"), Some("there is no such file"));
    assert_eq!(fault(&page, "plans.md#no-such-part"), Some("there is no such heading"));
    assert_eq!(fault(&page, "reliability.md#the-watchdog"), None);
    assert_eq!(links("a [b](c) `d`\n```\n[e](f)\n```\n"), [(1, "c".to_owned())]);
}

#[test]
fn the_pictures_of_the_pages_are_small() {
    let folder = repository().join("docs/pictures");
    let sizes = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").metadata().expect("a file").len());
    let total: u64 = sizes.sum();
    assert!(total < 1 << 20, "{total} bytes");
}
