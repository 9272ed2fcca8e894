use lookdown_detect::detection::BBox;
use lookdown_lens::geometry::{OrientedBox, Pixel, floor::FloorPosition};

use super::*;

fn person(corners: [f64; 4], angle_deg: f64) -> AnnotatedBox {
    AnnotatedBox {
        bbox: BBox::new(corners).unwrap(),
        oriented_box: turned(60.0, 50.0, angle_deg),
        score: 0.876_54,
        floor: None,
    }
}

fn turned(x: f64, y: f64, angle_deg: f64) -> OrientedBox {
    OrientedBox::turned(Pixel::new(x, y), 20.0, 40.0, angle_deg.to_radians())
}

/// An image of 200×100 pixels with one person inside, one half outside and one outside.
fn image(file_name: &str) -> AnnotatedImage {
    AnnotatedImage {
        file_name: file_name.to_owned(),
        width: 200,
        height: 100,
        calibration: Some("lobby".to_owned()),
        persons: vec![
            person([40.0, 30.0, 80.0, 70.0], -30.0),
            person([190.0, -20.0, 230.0, 10.004], 0.0),
            person([210.0, 20.0, 230.0, 40.0], 0.0),
        ],
    }
}

fn content(format: AnnotationFormat, path: &str) -> String {
    let images = [image("hall/a & b.jpg"), image("c.png")];
    let files = format.files(&images, BoxKind::AxisParallel);
    let file = files.into_iter().find(|file| file.path == path);
    file.unwrap().content
}

#[test]
fn coco_has_ids_and_the_additional_keys() {
    let text = content(AnnotationFormat::Coco, "annotations.json");
    let document: serde_json::Value = serde_json::from_str(&text).unwrap();
    let expected = serde_json::json!({
        "id": 4, "image_id": 2, "category_id": 1, "bbox": [190.0, 0.0, 10.0, 10.0],
        "area": 100.0, "iscrowd": 0, "segmentation": [], "score": 0.8765,
        "oriented_box": {"cx": 60.0, "cy": 50.0, "width": 20.0, "height": 40.0, "angle_deg": 0.0},
    });
    assert_eq!(document["annotations"][3], expected);
    let expected = serde_json::json!(
        {"id": 1, "file_name": "hall/a & b.jpg", "width": 200, "height": 100,
         "calibration": "lobby"});
    assert_eq!(document["images"][0], expected);
    assert_eq!(document["categories"][0]["name"], "person");
}

#[test]
fn cvat_has_a_box_element_per_person_and_escaped_names() {
    let text = content(AnnotationFormat::Cvat, "annotations.xml");
    let expected = r#"
  <image id="0" name="hall/a &amp; b.jpg" width="200" height="100">
    <box label="person" source="auto" occluded="0" xtl="40.00" ytl="30.00" xbr="80.00" ybr="70.00" z_order="0">
      <attribute name="score">0.8765</attribute>
    </box>
    <box label="person" source="auto" occluded="0" xtl="190.00" ytl="0.00" xbr="200.00" ybr="10.00" z_order="0">
      <attribute name="score">0.8765</attribute>
    </box>
  </image>
"#;
    assert!(text.contains(expected), "{text}");
}

#[test]
fn cvat_rotates_boxes_clockwise_about_their_center() {
    let files = AnnotationFormat::Cvat.files(&[image("a.jpg")], BoxKind::Oriented);
    let expected =
        r#"xtl="50.00" ytl="30.00" xbr="70.00" ybr="70.00" z_order="0" rotation="330.00""#;
    assert!(files[0].content.contains(expected), "{}", files[0].content);
    let rotations = files[0].content.matches("rotation=\"").count();
    assert_eq!(rotations, 2);
}

#[test]
fn yolo_has_relative_boxes_a_file_per_image_and_the_class() {
    assert_eq!(
        content(AnnotationFormat::Yolo, "labels/hall/a & b.txt"),
        "0 0.300000 0.500000 0.200000 0.400000\n0 0.975000 0.050000 0.050000 0.100000\n"
    );
    assert_eq!(content(AnnotationFormat::Yolo, "classes.txt"), "person\n");
    assert!(content(AnnotationFormat::Yolo, "data.yaml").contains("  0: person\n"));
}

#[test]
fn yolo_obb_has_the_corners_of_boxes_within_the_image() {
    let mut image = image("a.jpg");
    image.persons.truncate(2);
    image.persons[0].oriented_box = turned(30.0, 50.0, 90.0);
    image.persons[1].oriented_box = turned(190.0, 50.0, 0.0);
    let text = AnnotationFormat::Yolo.document(&image, BoxKind::Oriented);
    let expected = "0 0.250000 0.400000 0.250000 0.600000 0.050000 0.600000 0.050000 0.400000\n\
                    0 0.900000 0.300000 1.000000 0.300000 1.000000 0.700000 0.900000 0.700000\n";
    assert_eq!(text, expected);
}

#[test]
fn cepdof_has_five_numbers_per_box() {
    let text = content(AnnotationFormat::Cepdof, "annotations.json");
    let document: serde_json::Value = serde_json::from_str(&text).unwrap();
    let expected = serde_json::json!({
        "id": 1, "image_id": 1, "category_id": 1, "bbox": [60.0, 50.0, 20.0, 40.0, -30.0],
        "area": 800.0, "iscrowd": 0, "segmentation": [], "score": 0.8765,
    });
    assert_eq!(document["annotations"][0], expected);
}

#[test]
fn label_studio_rotates_about_the_upper_left_corner() {
    let mut image = image("hall/a & b+1.jpg");
    image.persons[0].oriented_box = turned(60.0, 50.0, -90.0);
    let region = |boxes| {
        let text = AnnotationFormat::LabelStudio.document(&image, boxes);
        let tasks: serde_json::Value = serde_json::from_str(&text).unwrap();
        let address = "/data/local-files/?d=hall/a%20%26%20b%2B1.jpg";
        assert_eq!(tasks[0]["data"]["image"], address);
        tasks[0]["predictions"][0]["result"][0].clone()
    };
    let expected = serde_json::json!({"x": 20.0, "y": 60.0, "width": 10.0, "height": 40.0,
        "rotation": 270.0, "rectanglelabels": ["person"]});
    assert_eq!(region(BoxKind::Oriented)["value"], expected);
    let expected = serde_json::json!({"x": 20.0, "y": 30.0, "width": 20.0, "height": 40.0,
        "rotation": 0.0, "rectanglelabels": ["person"]});
    assert_eq!(region(BoxKind::AxisParallel)["value"], expected);
}

#[test]
fn voc_has_corners_in_a_file_per_image() {
    let text = content(AnnotationFormat::Voc, "Annotations/hall/a & b.xml");
    assert!(text.contains("<folder>hall</folder>\n  <filename>a &amp; b.jpg</filename>"));
    let corners = "<xmin>190.00</xmin>\n      <ymin>0.00</ymin>\n      <xmax>200.00</xmax>\n      \
                   <ymax>10.00</ymax>";
    assert!(text.contains(corners), "{text}");
    assert_eq!(text.matches("<object>").count(), 2);
    let list = content(AnnotationFormat::Voc, "ImageSets/Main/default.txt");
    assert_eq!(list, "hall/a & b\nc\n");
}

#[test]
fn geojson_has_the_oriented_box_and_the_floor_position() {
    let mut image = image("hall/a.jpg");
    image.persons[1].floor = Some(FloorPosition {
        x_m: 1.873_49,
        y_m: -0.5,
    });
    let text = AnnotationFormat::GeoJson.document(&image, BoxKind::AxisParallel);
    let document: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(document["type"], "FeatureCollection");
    assert_eq!(document["features"].as_array().unwrap().len(), 2);
    let expected = serde_json::json!({
        "type": "Feature", "id": 2,
        "geometry": {"type": "Polygon", "coordinates": [
            [[50.0, 30.0], [70.0, 30.0], [70.0, 70.0], [50.0, 70.0], [50.0, 30.0]]]},
        "properties": {
            "label": "person", "score": 0.8765, "box": [190.0, 0.0, 200.0, 10.0],
            "angle_deg": 0.0, "foot": [60.0, 70.0], "floor": {"x_m": 1.873, "y_m": -0.5}},
    });
    assert_eq!(document["features"][1], expected);
    // The shoelace formula: positive if the ring is counterclockwise with y upward.
    for feature in document["features"].as_array().unwrap() {
        let ring: Vec<[f64; 2]> =
            serde_json::from_value(feature["geometry"]["coordinates"][0].clone()).unwrap();
        let area: f64 = ring
            .windows(2)
            .map(|pair| pair[0][0] * pair[1][1] - pair[1][0] * pair[0][1])
            .sum();
        assert!((area / 2.0 - 800.0).abs() < 2.0, "{area}");
    }
}

#[test]
fn the_document_of_an_image_is_its_file_in_a_folder_of_one() {
    for &format in AnnotationFormat::VARIANTS {
        let image = image("a.jpg");
        let document = format.document(&image, BoxKind::Oriented);
        let files = format.files(&[image], BoxKind::Oriented);
        assert!(
            files.iter().any(|file| file.content == document),
            "{format}"
        );
    }
}

#[test]
fn the_own_file_of_an_image_is_among_the_files() {
    for &format in AnnotationFormat::VARIANTS {
        let image = image("hall.2/left");
        let own = format.own_file(&image.file_name);
        let files = format.files(&[image], BoxKind::AxisParallel);
        assert!(own.is_none_or(|own| files.iter().any(|file| file.path == own)));
    }
    assert_eq!(
        AnnotationFormat::Voc.own_file("hall.2/left").unwrap(),
        "Annotations/hall.2/left.xml"
    );
}

#[test]
fn an_image_without_persons_is_listed_in_every_format() {
    let empty = AnnotatedImage {
        persons: Vec::new(),
        calibration: None,
        ..image("a.jpg")
    };
    for &format in AnnotationFormat::VARIANTS {
        let files = format.files(std::slice::from_ref(&empty), BoxKind::Oriented);
        let named =
            |file: &AnnotationFile| file.path.contains("/a.") || file.content.contains("a.jpg");
        assert!(files.iter().any(named), "{format}");
    }
}

/// A VOC file, or a CVAT file of one image.
#[derive(serde::Deserialize)]
struct NamedImage {
    filename: Option<String>,
    image: Option<CvatImage>,
}

#[derive(serde::Deserialize)]
struct CvatImage {
    #[serde(rename = "@name")]
    name: String,
}

#[test]
fn any_file_name_is_read_back_from_the_xml() {
    let nasty = "<a> \"b\" 'c' &amp; \t\n\r\u{1}\u{ffff}.jpg";
    let expected = "<a> \"b\" 'c' &amp; \u{fffd}\u{fffd}\u{fffd}\u{fffd}\u{fffd}.jpg";
    for format in [AnnotationFormat::Cvat, AnnotationFormat::Voc] {
        let text = &format.document(&image(nasty), BoxKind::AxisParallel);
        let read: NamedImage = quick_xml::de::from_str(text).unwrap();
        let name = read.filename.or(read.image.map(|image| image.name));
        assert_eq!(name.as_deref(), Some(expected), "{text}");
    }
}
