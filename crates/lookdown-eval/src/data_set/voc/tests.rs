//! Tests of VOC files.

use super::super::test_support::{boxes, folder, open, refusal};

const XML: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<annotation>
    <filename>other.jpg</filename>
    <size><width>800</width><height>600</height></size>
    <object><name>person</name>
        <bndbox><xmin>626.25</xmin><ymin>186.0</ymin><xmax>664.5</xmax><ymax>212.25</ymax></bndbox>
    </object>
    <object><name>dog</name></object>
    <object><name> Person </name><difficult>1</difficult>
        <bndbox><ymin>2</ymin><xmin>1</xmin><ymax>4</ymax><xmax>3</xmax></bndbox>
    </object>
</annotation>"#;
const WITHOUT_PERSONS: &str =
    "<annotation><size><width>8</width><height>6</height></size></annotation>";

#[test]
fn persons_are_read_and_difficult_ones_do_not_count() {
    let data_set = open(&folder(&[
        ("Annotations/000001.xml", XML),
        ("Annotations/000002.xml", WITHOUT_PERSONS),
        ("JPEGImages/000001.jpg", ""),
        ("JPEGImages/000002.jpg", ""),
        ("JPEGImages/000003.jpg", ""),
    ]));
    let [first, second] = &data_set.images[..] else {
        panic!("two images")
    };
    assert_eq!(boxes(first), [[626.25, 186.0, 664.5, 212.25]]);
    assert_eq!(first.truth.persons.len(), 2);
    assert_eq!(first.size, Some([800, 600]));
    assert_eq!(first.id.to_string(), "Annotations/000001");
    assert!(first.path.ends_with("JPEGImages/000001.jpg"));
    assert!(second.truth.persons.is_empty());
}

#[test]
fn boxes_for_piropo_are_matched_to_images_by_time() {
    let name = "2015-05-12T12-42-29.320Z";
    let data_set = open(&folder(&[
        (
            &format!("normal/piropo/Room_A/omni_1A/omni_1A_test2/{name}.xml"),
            XML,
        ),
        (&format!("omni_1A/omni1A_test2/{name}.jpg"), ""),
        (
            "omni_1A/Ground_Truth_Annotations/groundTruth_omni1A_test2.csv",
            "1,2,3",
        ),
    ]));
    assert_eq!(boxes(&data_set.images[0]).len(), 1);
    let expected = format!("omni_1A/omni1A_test2/{name}.jpg");
    assert!(data_set.images[0].path.ends_with(expected));
}

#[test]
fn errors_name_the_file_and_the_problem() {
    for (from, to, expected) in [
        ("</annotation>", "", "not a VOC annotation: "),
        ("annotation>", "svg>", "its root is <svg>"),
        ("<xmin>626.25</xmin>", "", "bndbox: xmin is \"\""),
        ("626.25", "left", "bndbox: xmin is \"left\""),
        ("626.25", "700", "bndbox: box"),
        (
            "<width>800</width>",
            "<width>-8</width>",
            "size: width is \"-8\"",
        ),
        ("bndbox>", "robndbox>", "an object has no bndbox"),
        ("erson", "edestrian", "is named person"),
    ] {
        let text = XML.replace(from, to);
        let error = refusal(&folder(&[("a.xml", &text), ("a.jpg", "")]));
        assert!(error.contains("a.xml: "), "{error}");
        assert!(error.contains(expected), "{error}");
    }
    let error = refusal(&folder(&[("a.xml", XML), ("b.jpg", "")]));
    assert!(error.contains("no image a was found"), "{error}");
}

#[test]
fn entity_bombs_and_deep_nesting_are_refused() {
    let bomb =
        r#"<!DOCTYPE a [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]><annotation>&b;</annotation>"#;
    let error = refusal(&folder(&[("a.xml", bomb), ("a.jpg", "")]));
    assert!(error.contains("not a VOC annotation: "), "{error}");
    let deep = "<annotation>".repeat(1_000_000);
    let error = refusal(&folder(&[("a.xml", &deep), ("a.jpg", "")]));
    assert!(error.contains("not a VOC annotation: "), "{error}");
}
