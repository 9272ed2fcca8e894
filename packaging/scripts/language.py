"""Lists sentences and names that break the rules of CONTRIBUTING.md, "How we write": `language.py [PATH...]`.

It reads the tracked Rust, Python, JavaScript and Markdown files below the given paths, everything by default, for one
rule all text files, and prints one line per finding. What a machine can hold is held here; the rest is for reviewers.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LONGEST_TEST_NAME = 60
LONGEST_SUMMARY_WORDS = 6
LONGEST_SENTENCE_WORDS = 35
WIDEST_COMMENT = 100
QUESTION_WORDS = "What|Who|Whom|Whose|How|Whether|Where|Which|Of|Why|When"
# Things are not persons.
PERSONS = re.compile(r"\b(somebody|nobody|whoever|anybody|everybody|whomever)\b", re.IGNORECASE)
# Beginnings of words that prose spells in another way, or replaces. Names of keys, files and CSS classes keep theirs.
OTHER_WORDS = {
    "artefact": "artifact",
    "behaviour": "behavior",
    "centre": "center",
    "colour": "color",
    "defence": "defense",
    "favour": "favor",
    "grey": "gray",
    "honour": "honor",
    "labelled": "labeled",
    "labelling": "labeling",
    "learnt": "learned",
    "licence": "license",
    "metre": "meter",
    "modelled": "modeled",
    "neighbour": "neighbor",
    "normalis": "normaliz",
    "optimis": "optimiz",
    "quantis": "quantiz",
    "recognis": "recogniz",
    "serialis": "serializ",
    "towards": "toward",
}
# Not in a name, such as `centre_px`, `model.colours`, `"grey"` and `licence = "MIT"`.
OTHER_WORD = re.compile(rf"(?<![\w./#$'\"-])({'|'.join(OTHER_WORDS)})[a-z]*\b(?![-_./]\w|[\"'(]| ?=)", re.IGNORECASE)
# "Image" in prose and in names: of items, files, settings, metrics, keys, and classes of the page.
PICTURE = re.compile(r"[\w.:/#-]{0,40}picture[\w-]*", re.IGNORECASE)
# Names that others gave: Home Assistant's attribute.
NAMES_OF_OTHERS = {"entity_picture"}
IS_NO = re.compile(r"(?<!there )\b(is|are) no (?!longer|more|farther|further|reason|\W)", re.IGNORECASE)
# The prose of a line of code: its comment, and its strings that have a space.
COMMENT = re.compile(r"(?:^|\s)(?://[/!]?|#|/\*+) (\D.*)")
STRING = re.compile(r'"((?:[^"\\]|\\.)*)"')
# Names in prose: code, the fields of a formatted string, and the targets of links.
NAMES = re.compile(r"`[^`]*`|\{[^{}]*\}|\]\([^)]*\)")
FIRST_WORD = re.compile(rf"(?:{QUESTION_WORDS})\b(?!-)")
RUST_DOC = re.compile(r"^\s*//[/!](?!/) ?(.*)$")
RUST_COMMENT = re.compile(r"^\s*//")
# Parts of comments without a place to wrap: rows of tables, and long links and paths.
UNWRAPPABLE = re.compile(r"//[/!]? *\||\S{60}")
RUST_TEST = re.compile(r"#\[(?:tokio::)?test\b")
RUST_FUNCTION = re.compile(r"\bfn (\w+)")
# Markdown lines without sentences: empty lines, headings, rows of tables, HTML, and images.
NOT_PROSE = re.compile(r"$|#|\||<|!\[")
LIST_ITEM = re.compile(r"^\s*(?:[*+-]|\d+\.|>) +")
# An inline code span counts as one word.
CODE_SPAN = re.compile(r"`[^`]+`")
SENTENCE_END = re.compile(r"(?:[.!?]|:(?= +[A-Z`\[(*]))[)\"*]* +")
PYTHON_TEST = re.compile(r"^\s*(?:async )?def (test_\w+)")
# Files that hold the rules, and texts of others.
EXEMPT = {
    "packaging/scripts/language.py",
    "packaging/scripts/tests/test_language.py",
    "CONTRIBUTING.md",
    "LICENSE",
    "NOTICE",
}
SUFFIXES = {".rs", ".py", ".js", ".mjs", ".md", ".html"}


def tracked_files(paths):
    """The tracked files below the paths, relative to the repository."""
    listed = subprocess.run(["git", "ls-files", "--", *paths], cwd=ROOT, check=True, capture_output=True, text=True)
    return [name for name in listed.stdout.splitlines() if name not in EXEMPT]


def text_lines(path):
    """The lines of a text file; none of a binary file, or of one that is not there."""
    content = path.read_bytes() if path.is_file() else b""
    return [] if b"\0" in content else content.decode("utf-8", "replace").splitlines()


def prose(name, line):
    """The prose of a line, without the names in it."""
    if not name.endswith(".md"):
        line = " ".join([*COMMENT.findall(line), *(text for text in STRING.findall(line) if " " in text)])
    return NAMES.sub("", line)


def findings_in_text(name, lines):
    """Words that make persons of things, words with another form, and "is no" for "is not a"."""
    for number, line in enumerate(lines, 1):
        text = prose(name, line)
        for found in OTHER_WORD.finditer(text):
            yield f"{name}:{number}: `{found.group()}`: write `{OTHER_WORDS[found.group(1).lower()]}…`"
        if found := IS_NO.search(text):
            yield f"{name}:{number}: `{found.group().strip()}`: write `{found.group(1)} not`"
        if found := PERSONS.search(line):
            yield f"{name}:{number}: `{found.group()}`: name the client, the caller or the component"


def findings_in_names(name, lines):
    """The word "picture", also in names and in the name of the file."""
    for number, line in enumerate([name, *lines]):
        for found in PICTURE.finditer(line):
            if found.group() not in NAMES_OF_OTHERS:
                yield f"{name}:{number}: `{found.group()}`: write `image`, or `frame` for the image of a request"


def findings_in_rust(name, lines):
    """First words of doc comments, the width of comments, and the length of the names of tests."""
    is_in_doc = is_test = was_empty = False
    for number, line in enumerate(lines, 1):
        doc = RUST_DOC.match(line)
        is_empty = bool(doc) and not doc.group(1)
        if is_empty and was_empty:
            yield f"{name}:{number}: two empty lines in a doc comment: remove one"
        was_empty = is_empty
        if len(line) > WIDEST_COMMENT and RUST_COMMENT.match(line) and not UNWRAPPABLE.search(line):
            yield f"{name}:{number}: a comment has {len(line)} columns: wrap it at {WIDEST_COMMENT}"
        if doc and not is_in_doc and FIRST_WORD.match(doc.group(1)):
            first = doc.group(1).split()[0]
            yield f"{name}:{number}: a doc comment begins with `{first}`: begin with a verb or a noun phrase"
        # A section such as `# Errors` begins like the comment itself.
        is_in_doc = bool(doc) and not doc.group(1).startswith("# ")
        is_test = is_test or bool(RUST_TEST.search(line))
        if is_test and (function := RUST_FUNCTION.search(line)):
            is_test = False
            yield from finding_of_test_name(name, number, function.group(1))


def finding_of_test_name(name, number, test):
    """The finding about the length of a test's name, if it is too long."""
    if len(test) > LONGEST_TEST_NAME:
        yield f"{name}:{number}: the test name `{test}` has {len(test)} characters, {LONGEST_TEST_NAME} are allowed"


def findings_in_python(name, lines):
    """The length of the names of tests."""
    for number, line in enumerate(lines, 1):
        if test := PYTHON_TEST.match(line):
            yield from finding_of_test_name(name, number, test.group(1))


def paragraphs(lines):
    """The paragraphs and list items of Markdown with the number of their first line, without tables and code."""
    first, text, is_code = 0, [], False
    for number, line in enumerate([*lines, ""], 1):
        stripped = line.strip()
        is_fence = stripped.startswith("```")
        is_code ^= is_fence
        # Four spaces are code, except in the lines that continue a list item.
        is_indented_code = not text and line.startswith("    ")
        is_prose = not (is_code or is_fence or is_indented_code or NOT_PROSE.match(stripped))
        if text and (not is_prose or LIST_ITEM.match(line)):
            yield first, " ".join(text)
            text = []
        if is_prose:
            first = first if text else number
            text.append(LIST_ITEM.sub("", stripped))


def findings_in_markdown(name, lines):
    """Sentences that are too long."""
    for number, paragraph in paragraphs(lines):
        for sentence in SENTENCE_END.split(CODE_SPAN.sub("`code`", paragraph)):
            words = [word for word in sentence.split() if any(map(str.isalnum, word))]
            if len(words) > LONGEST_SENTENCE_WORDS:
                start = " ".join(words[:6])
                yield f"{name}:{number}: a sentence has {len(words)} words, {LONGEST_SENTENCE_WORDS} are allowed: {start}"


def findings_in_openapi(name, text):
    """Summaries that are questions or too long."""
    for path, operations in json.loads(text)["paths"].items():
        for method, operation in operations.items():
            summary = operation.get("summary", "")
            words = len(summary.split())
            if summary.endswith("?") or not 1 <= words <= LONGEST_SUMMARY_WORDS:
                yield f"{name}: {method.upper()} {path}: the summary `{summary}` is not an imperative of 1 to 6 words"


def findings(paths):
    """All findings below the paths."""
    for name in tracked_files(paths):
        path = ROOT / name
        lines = text_lines(path)
        yield from findings_in_names(name, lines)
        if name.startswith("openapi/") and path.suffix == ".json":
            yield from findings_in_openapi(name, path.read_text("utf-8"))
        if path.suffix not in SUFFIXES:
            continue
        yield from findings_in_text(name, lines)
        if path.suffix == ".rs":
            yield from findings_in_rust(name, lines)
        elif path.suffix == ".py":
            yield from findings_in_python(name, lines)
        elif path.suffix == ".md":
            yield from findings_in_markdown(name, lines)


if __name__ == "__main__":
    found = list(findings(sys.argv[1:]))
    print("\n".join(found))
    print(f"{len(found)} findings")
    sys.exit(bool(found))
