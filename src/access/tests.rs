use super::*;

fn digest_of(key: &str) -> String {
    KeyDigest::new(key.as_bytes()).hexadecimal()
}

fn line(name: &str, scopes: &str, key: &str) -> String {
    format!(
        "{name} = {{ scopes = [{scopes}], sha256 = \"{}\" }}\n",
        digest_of(key)
    )
}

fn name_of(list: &KeyList, key: &str) -> Option<String> {
    list.holder_of(key.as_bytes())
        .map(|holder| holder.name.to_string())
}

#[test]
fn a_file_and_a_variable_give_the_same_keys() {
    let text = line("gate", "\"detect\", \"read\"", "one") + &line("office", "\"admin\"", "two");
    let file = KeyList::from_toml(&text).unwrap();
    let (one, two) = (digest_of("one"), digest_of("two"));
    let variable = format!("gate:read+detect:{one}, office:admin:{two},");
    assert_eq!(file, variable.parse().unwrap());
    assert_eq!(
        (name_of(&file, "one"), name_of(&file, "two")),
        (Some("gate".to_owned()), Some("office".to_owned()))
    );
    let gate = file.holder_of(b"one").unwrap();
    assert_eq!(gate.scopes.joined("+"), "detect+read");
}

#[test]
fn only_the_whole_key_is_accepted() {
    let list = KeyList::from_toml(&line("gate", "\"detect\"", "secret")).unwrap();
    let digest = digest_of("secret");
    for wrong in [
        "",
        "s",
        "secre",
        "secrets",
        "Secret",
        " secret",
        "secret\0",
        digest.as_str(),
    ] {
        assert_eq!(name_of(&list, wrong), None, "{wrong:?}");
    }
    assert_eq!(KeyList::default().holder_of(b""), None);
}

#[test]
fn errors_name_the_position_and_do_not_repeat_the_input() {
    let good = digest_of("one");
    let leak = "lookdown_do-not-show-me";
    for (text, expected) in [
        (format!("gate = \"{leak}\""), "line 1:"),
        (
            format!("\n\ngate = {{ scopes = \"{leak}\", sha256 = \"{good}\" }}"),
            "line 3:",
        ),
        (format!("gate = {{ key = \"{leak}\" }}"), "line 1:"),
        (format!("gate = {leak}"), "line 1:"),
        (
            format!("gate = {{ scopes = [\"detect\"], sha256 = \"{leak}\" }}"),
            "never the key itself",
        ),
        (
            format!("gate = {{ scopes = [\"{leak}\"], sha256 = \"{good}\" }}"),
            "detect, read, view and admin",
        ),
        (
            format!("gate = {{ scopes = [], sha256 = \"{good}\" }}"),
            "detect, read, view and admin",
        ),
        (
            format!("\"{leak}!\" = {{ scopes = [\"read\"], sha256 = \"{good}\" }}"),
            "a name is",
        ),
        (
            line("gate", "\"read\"", "one") + &line("gate", "\"read\"", "two"),
            "line 2:",
        ),
    ] {
        let message = KeyList::from_toml(&text).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
        assert!(!message.contains("do-not-show-me"), "{message}");
    }
    for (text, expected) in [
        (leak.to_owned(), "name:scope+scope:sha256"),
        (format!("gate:detect:{leak}"), "never the key itself"),
        (
            format!("gate:{leak}:{good}"),
            "detect, read, view and admin",
        ),
        (format!("a:read:{good},a:read:{good}"), "key 2: its name"),
    ] {
        let message = text.parse::<KeyList>().unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
        assert!(!message.contains("do-not-show-me"), "{message}");
    }
}

#[test]
fn a_line_that_is_not_a_key_takes_no_other_one_with_it() {
    let bad = "gate = { scopes = [\"detect\"], sha256 = \"do-not-show-me\" }\n";
    let worse = "yard = 5\n";
    let text = format!("{bad}{}{worse}", line("office", "\"read\"", "one"));
    let own = format!("gate:view:{}", digest_of("two")).parse::<KeyList>();
    let list = own.unwrap().with(KeyList::from_toml(&text).unwrap());
    assert_eq!(
        (name_of(&list, "one"), name_of(&list, "two")),
        (Some("office".to_owned()), Some("gate".to_owned()))
    );
    let [first, second] = &list.problems[..] else {
        panic!("{:?}", list.problems)
    };
    assert!(first.starts_with("line 1: sha256 must"), "{first}");
    assert!(second.starts_with("line 3: a key is a line"), "{second}");
    let twice = KeyList::from_toml(&line("office", "\"admin\"", "three"));
    let list = list.with(twice.unwrap());
    assert_eq!(name_of(&list, "three"), None);
    assert!(list.problems[2].starts_with("office: its name is used twice"));
}

#[test]
fn more_than_a_thousand_keys_are_refused() {
    let lines = |count: usize| -> String {
        let line = |at| line(&format!("key-{at}"), "\"read\"", &format!("{at}"));
        (0..count).map(line).collect()
    };
    assert_eq!(
        KeyList::from_toml(&lines(MAX_KEYS)).unwrap().len(),
        MAX_KEYS
    );
    let list = KeyList::from_toml(&lines(MAX_KEYS + 1)).unwrap();
    assert_eq!((list.len(), list.problems.len()), (MAX_KEYS, 1));
    assert!(list.problems[0].contains("more than 1000"));
}

#[test]
fn a_key_states_its_highest_priority_or_has_the_default() {
    let digest = digest_of("one");
    let level_of = |list: KeyList| list.holder_of(b"one").unwrap().highest_priority.get();
    for (given, expected) in [("", 5), (", highest_priority = 1", 1)] {
        let text = format!("gate = {{ scopes = [\"read\"], sha256 = \"{digest}\"{given} }}");
        assert_eq!(level_of(KeyList::from_toml(&text).unwrap()), expected);
    }
    for (given, expected) in [("", 5), (":9", 9)] {
        let text = format!("gate:read:{digest}{given}");
        assert_eq!(level_of(text.parse().unwrap()), expected);
    }
    for wrong in ["0", "10", "high", "-1"] {
        let text = format!("gate:read:{digest}:{wrong}");
        let message = text.parse::<KeyList>().unwrap_err().to_string();
        assert!(message.contains("1 (highest) to 9"), "{message}");
    }
}

/// The example of FIPS 180-4.
const OF_ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

#[test]
fn the_digest_is_sha_256() {
    assert_eq!(KeyDigest::new(b"abc").hexadecimal(), OF_ABC);
    let parsed = KeyDigest::parse(&OF_ABC.to_uppercase()).unwrap();
    assert_eq!(parsed, KeyDigest::new(b"abc"));
}

#[test]
fn only_64_hexadecimal_digits_are_a_digest() {
    for wrong in [
        "",
        "ab",
        &OF_ABC[..62],
        &format!("{OF_ABC}00"),
        &OF_ABC[..63],
    ] {
        assert!(KeyDigest::parse(wrong).is_none(), "{wrong}");
    }
    assert!(KeyDigest::parse(&OF_ABC.replace('b', "g")).is_none());
}

#[test]
fn digests_that_agree_in_all_but_one_byte_differ() {
    let whole = KeyDigest::new(b"abc");
    for at in 0..BYTES {
        let mut other = whole.clone();
        other.0[at] ^= 1;
        assert_ne!(whole, other);
    }
}

#[test]
fn new_keys_are_long_differ_and_are_nowhere_in_debug_output() {
    let (one, other) = (new_key().unwrap(), new_key().unwrap());
    assert_ne!(one, other);
    assert_eq!(one.len(), PREFIX.len() + 64);
    assert_eq!(format!("{:?}", KeyDigest::new(b"abc")), "KeyDigest(…)");
}

#[test]
fn a_scope_opens_itself_and_admin_opens_all() {
    for &own in Scope::VARIANTS {
        for &wanted in Scope::VARIANTS {
            let opens = Scopes::new(&[own]).unwrap().allow(wanted);
            assert_eq!(opens, own == wanted || own == Scope::Admin);
        }
    }
    assert_eq!(Scopes::new(&[]), None);
}
