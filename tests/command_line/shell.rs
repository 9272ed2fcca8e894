//! `lookdown completions` and `lookdown manual`.

use std::fs;

use super::lookdown;

#[test]
fn completion_scripts_call_the_program() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = lookdown(&["completions", shell], &[]);
        let script = String::from_utf8(output.stdout).unwrap();
        assert!(script.contains("LOOKDOWN_COMPLETE"), "{shell}: {script}");
    }
}

/// Returns what bash offers for the last of these words.
fn offered(words: &[&str]) -> Vec<String> {
    let index = words.len().to_string();
    let variables = [
        ("LOOKDOWN_COMPLETE", "bash"),
        ("_CLAP_COMPLETE_INDEX", &index),
        ("_CLAP_IFS", "\n"),
    ];
    let arguments = [&["--", "lookdown"], words].concat();
    let output = lookdown(&arguments, &variables);
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| line.trim().to_owned()).collect()
}

#[test]
fn commands_flags_and_values_are_completed() {
    for (words, expected) in [
        (&["cal"][..], "calibration"),
        (&["detect", "--score-t"], "--score-threshold"),
        (&["detect", "--profile", "qu"], "quality"),
        (&["detect", "--refine", "soft_nms_g"], "soft_nms_gaussian"),
        (&["detect", "--format", "labels"], "labelstudio"),
    ] {
        assert_eq!(offered(words), [expected], "{words:?}");
    }
}

#[test]
fn names_of_models_are_completed() {
    let expected = ["ssdlite_mobilenet_v2".to_owned()];
    assert_eq!(offered(&["detect", "--model", "ssd"]), expected);
    assert!(offered(&["detect", "--model", "unknown"]).is_empty());
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
    for (command, is_listed) in [
        ("serve", true),
        ("completions", true),
        ("manual", true),
        ("openapi", false),
    ] {
        let line = format!("\n  {command} ");
        assert_eq!(help.contains(&line), is_listed, "{command}: {help}");
    }
}

#[test]
fn help_of_count_has_the_threshold_of_recordings() {
    for flag in ["--help", "-h"] {
        let output = lookdown(&["count", flag], &[]);
        let help = String::from_utf8(output.stdout).unwrap();
        let (_, threshold) = help.split_once("--score-threshold").unwrap();
        let (threshold, _) = threshold.split_once("\n      --").unwrap();
        assert!(threshold.contains("[default: 0.06]"), "{threshold}");
    }
}

#[test]
fn the_version_is_that_of_the_crate() {
    let output = lookdown(&["--version"], &[]);
    let said = String::from_utf8(output.stdout).unwrap();
    let wanted = concat!("lookdown ", env!("CARGO_PKG_VERSION"));
    assert!(said.starts_with(wanted), "{said}");
}
