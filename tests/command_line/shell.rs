//! `lookdown completions` and `lookdown manual`.

use std::fs;

use super::lookdown;

#[test]
fn completions_contain_the_commands() {
    for shell in ["bash", "zsh", "fish"] {
        let output = lookdown(&["completions", shell], &[]);
        let script = String::from_utf8(output.stdout).unwrap();
        for word in ["calibration", "score-threshold", "soft_nms_gaussian"] {
            assert!(script.contains(word), "{shell}: {word}: {script}");
        }
    }
}

#[test]
fn each_command_has_a_manual_page() {
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("new/man1");
    let output = lookdown(&["manual", pages.to_str().unwrap()], &[]);
    assert!(output.status.success(), "{output:?}");
    for (page, says) in [
        ("lookdown.1", "ceiling fisheye"),
        ("lookdown-serve.1", "HTTP server"),
        ("lookdown-calibration-check.1", "SYNOPSIS"),
    ] {
        let text = fs::read_to_string(pages.join(page)).unwrap();
        assert!(text.contains(says), "{page}: {text}");
    }
}

#[test]
fn help_lists_commands_of_users_only() {
    let output = lookdown(&["--help"], &[]);
    let help = String::from_utf8(output.stdout).unwrap();
    assert!(help.contains("\n  serve "), "{help}");
    for command in ["openapi", "completions", "manual"] {
        assert!(!help.contains(&format!("\n  {command} ")), "{help}");
    }
}

#[test]
fn the_version_is_that_of_the_crate() {
    let output = lookdown(&["--version"], &[]);
    let said = String::from_utf8(output.stdout).unwrap();
    let wanted = concat!("lookdown ", env!("CARGO_PKG_VERSION"));
    assert!(said.starts_with(wanted), "{said}");
}
