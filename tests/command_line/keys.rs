//! `lookdown key`

use lookdown::access::KeyList;

use crate::lookdown;

#[test]
fn a_new_key_is_printed_with_its_line_for_the_keys_file() {
    let scopes = ["--scope", "read", "--scope", "detect"];
    let new = || {
        lookdown(
            &[&["key", "new", "--name", "gate"], &scopes[..]].concat(),
            &[],
        )
    };
    let output = new();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    let lines: Vec<_> = text.lines().filter(|line| !line.starts_with('#')).collect();
    let [key, file_line, entry] = lines[..] else {
        panic!("{text}");
    };
    let file = KeyList::from_toml(file_line).unwrap();
    assert_eq!(file, entry.parse().unwrap());
    let holder = file.holder_of(key.as_bytes()).unwrap();
    assert_eq!(holder.name.to_string(), "gate");
    assert_eq!(holder.scopes.joined("+"), "detect+read");
    assert_ne!(new().stdout, output.stdout);
}

#[test]
fn a_new_key_states_its_highest_priority_if_one_is_given() {
    let arguments = ["key", "new", "--name", "alarm", "--scope", "detect"];
    for (flags, expected) in [
        (&[][..], 5),
        (&["--priority", "1"], 1),
        (&["--priority", "9"], 9),
    ] {
        let output = lookdown(&[&arguments, flags].concat(), &[]);
        let text = String::from_utf8(output.stdout).unwrap();
        let lines: Vec<_> = text.lines().filter(|line| !line.starts_with('#')).collect();
        let [key, file_line, entry] = lines[..] else {
            panic!("{text}");
        };
        let file = KeyList::from_toml(file_line).unwrap();
        assert_eq!(file, entry.parse().unwrap());
        let holder = file.holder_of(key.as_bytes()).unwrap();
        assert_eq!(holder.highest_priority.get(), expected);
    }
    for wrong in ["0", "10", "high"] {
        let output = lookdown(&[&arguments[..], &["--priority", wrong]].concat(), &[]);
        assert_eq!(output.status.code(), Some(2));
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(message.contains("1 (highest) to 9"), "{message}");
    }
}

#[test]
fn a_key_without_a_scope_or_with_an_invalid_name_is_refused() {
    for arguments in [
        &["key", "new", "--name", "gate"][..],
        &["key", "new", "--name", "gate", "--scope", "root"],
        &["key", "new", "--name", "a.b", "--scope", "read"],
    ] {
        let output = lookdown(arguments, &[]);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty());
    }
}
