//! The public API of the libraries, one listing each: `crates/*/public-api.txt`. Every change of the
//! API fails the test until `make bless` has rewritten the listing, so a review shows it. An item of
//! a released version is only removed or changed when the version is raised as semantic versioning
//! demands.

use std::{
    collections::BTreeSet,
    env, fs,
    ops::RangeInclusive,
    path::{Path, PathBuf},
    process::Command,
};

use semver::{Version, VersionReq};
use serde_json::Value;

const LIBRARIES: [&str; 3] = ["lookdown-detect", "lookdown-eval", "lookdown-lens"];
/// Formats of rustdoc's JSON that the crate `public_api` reads: Rust 1.95 writes 57.
const FORMATS: RangeInclusive<u64> = 57..=59;

/// Returns the folder with rustdoc's JSON of all crates of the workspace.
///
/// All crates are documented, because a selection would build dependencies again, with other
/// features.
fn document_workspace() -> PathBuf {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
    let status = Command::new(env!("CARGO"))
        .args(["doc", "--workspace", "--no-deps", "--lib", "--locked"])
        .args(["--quiet", "--target-dir"])
        .arg(target)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("RUSTDOC", repository("tests/repository/rustdoc_json.sh"))
        .env("RUSTDOCFLAGS", "-Z unstable-options --output-format json")
        .status();
    assert!(status.unwrap().success(), "cargo doc failed");
    target.join("doc")
}

/// Returns the public items of a library, a line each. `None` if this toolchain writes another
/// format.
fn public_items(json: &Path) -> Option<String> {
    let document: Value = serde_json::from_slice(&fs::read(json).unwrap()).unwrap();
    let format = document["format_version"].as_u64().unwrap();
    if !FORMATS.contains(&format) {
        eprintln!("not compared: rustdoc writes format {format}, {FORMATS:?} can be read");
        return None;
    }
    let api = public_api::Builder::from_rustdoc_json(json)
        .omit_blanket_impls(true)
        .omit_auto_trait_impls(true)
        .build();
    Some(without_trait_methods(&api.unwrap().to_string()))
}

/// Removes the methods of trait implementations, which follow from the trait.
fn without_trait_methods(items: &str) -> String {
    let mut implementing = None;
    let mut kept = String::new();
    for line in items.lines() {
        if line.starts_with("impl") {
            let after_for = line.split_once(" for ").map(|(_, after)| after);
            implementing = after_for.map(|after| after.split(" where ").next().unwrap());
        }
        let is_trait_method = implementing.is_some_and(|implementor| {
            line.strip_prefix("pub fn ")
                .and_then(|function| function.strip_prefix(implementor))
                .is_some_and(|rest| rest.starts_with("::"))
        });
        if !is_trait_method {
            kept.extend([line, "\n"]);
        }
    }
    kept
}

/// Returns the versions with a section in the changelog, such as `## [0.1.0] - 2026-12-01`.
fn released_versions(changelog: &str) -> Vec<Version> {
    let titles = changelog
        .lines()
        .filter_map(|line| line.strip_prefix("## ["));
    let versions = titles.filter_map(|title| title.split_once(']')?.0.parse().ok());
    versions.collect()
}

/// Returns the released version with which `current` must be compatible, if there is one.
fn bound_by<'a>(current: &Version, released: &'a [Version]) -> Option<&'a Version> {
    released.iter().find(|version| {
        // A requirement without an operator means "compatible with".
        VersionReq::parse(&version.to_string())
            .unwrap()
            .matches(current)
    })
}

/// Compares a listing with the API; with `BLESS=1`, rewrites it where semantic versioning permits it.
fn check(library: &str, items: &str, released: &[Version]) -> Result<(), String> {
    let name = format!("crates/{library}/public-api.txt");
    let listed = fs::read_to_string(repository(&name)).unwrap_or_default();
    if listed == items {
        return Ok(());
    }
    let (before, now): (BTreeSet<_>, BTreeSet<_>) =
        (listed.lines().collect(), items.lines().collect());
    let removed: Vec<_> = before.difference(&now).copied().collect();
    let added: Vec<_> = now.difference(&before).copied().collect();
    let bound = bound_by(&env!("CARGO_PKG_VERSION").parse().unwrap(), released);
    match bound {
        Some(version) if !removed.is_empty() => Err(format!(
            "{name}: items of {version} are removed or changed; keep them, or raise the version of \
             the workspace: {removed:#?}"
        )),
        _ if env::var_os("BLESS").is_some() => {
            fs::write(repository(&name), items).unwrap();
            Ok(())
        }
        _ => Err(format!(
            "{name}: run `make bless`; removed {removed:#?}, added {added:#?}"
        )),
    }
}

#[test]
fn the_public_api_of_each_library_is_the_listed_one() {
    let folder = document_workspace();
    let released = released_versions(&fs::read_to_string(repository("CHANGELOG.md")).unwrap());
    let mut problems = Vec::new();
    for library in LIBRARIES {
        let json = folder.join(library.replace('-', "_") + ".json");
        let Some(items) = public_items(&json) else {
            return;
        };
        problems.extend(check(library, &items, &released).err());
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn methods_of_traits_are_not_listed() {
    let items = "pub struct a::B\nimpl a::B\npub fn a::B::new() -> Self\nimpl Clone for a::B\n\
        pub fn a::B::clone(&self) -> a::B\npub type a::B::Err = u8\npub fn a::free()\n";
    let kept = "pub struct a::B\nimpl a::B\npub fn a::B::new() -> Self\nimpl Clone for a::B\n\
        pub type a::B::Err = u8\npub fn a::free()\n";
    assert_eq!(without_trait_methods(items), kept);
}

#[test]
fn released_items_stay_within_compatible_versions() {
    let changelog =
        "# Changelog\n## Unreleased\n## [0.2.1] - 2027-01-02\n## [0.1.0] - 2026-12-01\n";
    let released = released_versions(changelog);
    let bound =
        |version: &str| bound_by(&version.parse().unwrap(), &released).map(Version::to_string);
    assert_eq!(bound("0.1.7").as_deref(), Some("0.1.0"));
    assert_eq!(bound("0.2.1").as_deref(), Some("0.2.1"));
    assert_eq!(bound("0.3.0"), None);
    assert_eq!(released_versions("## Unreleased\n"), []);
}

fn repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}
