//! Generated parts of the documentation. Each part is in its file between `<!-- generated: NAME
//! -->` and `<!-- /generated -->`, and equals the text that the code generates. With `BLESS=1`
//! (`make bless`) the test rewrites the parts.

use std::{env, fs, path::Path};

use lookdown::api::problem_table;
use lookdown_calibration::warning::WarningCode;

/// A generated part of a file.
struct Section {
    file: &'static str,
    name: &'static str,
    content: fn() -> String,
}

/// Every generated part.
const SECTIONS: [Section; 2] = [
    Section {
        file: "docs/http.md",
        name: "problems",
        content: problem_table,
    },
    Section {
        file: "docs/http.md",
        name: "warnings",
        content: warning_table,
    },
];

const END: &str = "<!-- /generated -->";

/// Returns the table of all codes of warnings.
fn warning_table() -> String {
    let rows = WarningCode::ALL
        .iter()
        .map(|code| format!("| `{}` | {} |\n", code.name(), code.description()));
    format!(
        "| code | meaning |\n|---|---|\n{}",
        rows.collect::<String>()
    )
}

/// Returns the text with other content between the markers of `name`.
fn with_section(text: &str, name: &str, content: &str) -> String {
    let begin = format!("<!-- generated: {name} -->\n");
    let (before, rest) = text.split_once(&begin).unwrap();
    let (_, after) = rest.split_once(END).unwrap();
    format!("{before}{begin}{content}{END}{after}")
}

#[test]
fn generated_parts_of_the_documentation_are_current() {
    for section in SECTIONS {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(section.file);
        let text = fs::read_to_string(&path).unwrap();
        let current = with_section(&text, section.name, &(section.content)());
        if env::var_os("BLESS").is_some() {
            fs::write(&path, &current).unwrap();
        } else {
            let (file, name) = (section.file, section.name);
            assert!(text == current, "{file}: run `make bless`, {name} differ");
        }
    }
}

#[test]
fn only_the_marked_part_is_replaced() {
    let text = "a\n<!-- generated: t -->\nold\n<!-- /generated -->\nb\n";
    let expected = "a\n<!-- generated: t -->\nnew\n<!-- /generated -->\nb\n";
    assert_eq!(with_section(text, "t", "new\n"), expected);
}
