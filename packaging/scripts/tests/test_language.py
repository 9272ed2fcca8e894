"""The language rules: the tree keeps them, and the checker finds what breaks them."""

import unittest

import language


class Language(unittest.TestCase):
    def test_the_tree_keeps_the_rules(self):
        self.assertEqual([*language.findings([])], [])

    def test_first_words_of_doc_comments_are_checked(self):
        lines = ["/// Whether it is so.", "fn a() {}", "/// Returns it.", "/// How it wraps is free.", "//! What."]
        found = [*language.findings_in_rust("a.rs", lines)]
        self.assertEqual([line.split(":")[1] for line in found], ["1"])

    def test_first_words_of_sections_are_checked(self):
        lines = ["/// Returns it.", "///", "/// # Errors", "/// When it is not there.", "fn a() {}"]
        found = [*language.findings_in_rust("a.rs", lines)]
        self.assertEqual([line.split(":")[1] for line in found], ["4"])

    def test_wide_comments_and_doubled_empty_lines_are_found(self):
        wide = "word " * 20
        lines = [f"/// {wide}", f"let a = 1; // {wide}", "///", "///", f"/// | {wide} |", f"// {'a' * 100}"]
        found = [*language.findings_in_rust("a.rs", lines)]
        self.assertEqual([line.split(":")[1] for line in found], ["1", "4"])

    def test_persons_for_things_are_found(self):
        found = [*language.findings_in_text("a.md", ["nobody waits", "the client waits", "Whoever asks"])]
        self.assertEqual([line.split(":")[1] for line in found], ["1", "3"])

    def test_long_test_names_are_found(self):
        long = "a" * 61
        rust = ["#[tokio::test]", f"async fn {long}() {{", f"fn {long}() {{"]
        self.assertEqual(len([*language.findings_in_rust("a.rs", rust)]), 1)
        self.assertEqual(len([*language.findings_in_python("a.py", [f"def test_{long}(self):"])]), 1)

    def test_summaries_are_short_imperatives(self):
        def document(summary):
            return f'{{"paths": {{"/a": {{"get": {{"summary": "{summary}"}}}}}}}}'

        for summary, count in [
            ("List calibrations", 0),
            ("Is it ready?", 1),
            ("", 1),
            ("One two three four five six seven", 1),
        ]:
            self.assertEqual(len([*language.findings_in_openapi("o", document(summary))]), count, summary)

    def test_long_sentences_are_found(self):
        lines = ["# Title", "", "Short. " + "word " * 20, "word " * 15 + "word.", "", "* " + "word " * 36, "* item"]
        found = [*language.findings_in_markdown("a.md", lines)]
        self.assertEqual([line.split(":")[1] for line in found], ["3", "6"])

    def test_tables_headings_and_code_have_no_sentences(self):
        long = "word " * 40
        lines = [f"# {long}", "", f"| {long} |", "", "```", long, "```", "", f"    {long}", "", f"It is `{long}`."]
        self.assertEqual([*language.findings_in_markdown("a.md", lines)], [])

    def test_sentences_end_at_points_and_items(self):
        half = " ".join(["word"] * 20)
        for text in [f"{half}. {half}", f"**{half}.** {half}", f"({half}.) {half}", f"{half}: The {half}"]:
            self.assertEqual([*language.findings_in_markdown("a.md", [text])], [], text)
        for lines in [[f"{half}:", f"* {half}"], [f"1. {half}", f"2. {half}"], [half, "", half]]:
            self.assertEqual([*language.findings_in_markdown("a.md", lines)], [], lines)
        for text in [f"{half}: {half}", f"{half}; {half}"]:
            self.assertEqual(len([*language.findings_in_markdown("a.md", [text])]), 1, text)

    def test_british_words_are_found_in_prose(self):
        for name, line in [
            ("a.md", "The colour of the text"),
            ("a.md", "A box, and a metre"),
            ("a.md", "It is no error."),
            ("a.rs", "/// The centre of the box."),
            ("a.rs", '    bail!("{name} is no number of metres")'),
            ("a.py", "x = 1  # towards the rim"),
        ]:
            self.assertTrue([*language.findings_in_text(name, [line])], line)

    def test_names_keep_their_spelling(self):
        for name, line in [
            ("a.md", "The key `licence` and [colors](page.md#colours), model.colours"),
            ("a.rs", "let centre = colour(grey);"),
            ("a.rs", 'format!("of {colour}: centre_px and licence = 3")'),
            ("a.py", 'values["colour"] * grey'),
            ("a.md", "There is no calibration, and it is no longer used."),
        ]:
            self.assertEqual([*language.findings_in_text(name, [line])], [], line)

    def test_the_word_picture_is_found_in_prose_and_names(self):
        for name, line in [
            ("a.md", "Two pictures"),
            ("a.rs", "struct StoredPicture;"),
            ("a.py", "MOST_PICTURES = 2"),
            ("a.lua", "redis.call('ZADD', pictures, micros, camera)"),
            ("a.html", '<img id="views-picture" alt="">'),
            ("a.toml", "max_pictures = 64"),
            ("src/picture.rs", ""),
        ]:
            self.assertEqual(len([*language.findings_in_names(name, [line])]), 1, line)

    def test_names_of_others_keep_the_word_picture(self):
        self.assertEqual([*language.findings_in_names("a.py", ['state["entity_picture"]'])], [])
