//! YOLO: a text file per image in `labels/`, with `data.yaml` (Ultralytics) and `classes.txt`
//! (Label Studio) next to them. The images belong in `images/`. A line is `class cx cy width
//! height`, or with oriented boxes (YOLO OBB) `class x1 y1 x2 y2 x3 y3 x4 y4`, relative to the
//! image's sides.

use std::fmt::Write;

use super::content::{
    AnnotatedImage, AnnotationFile, BoxKind, FormatSpec, LABEL, Layout, SupportedBoxes, file, stem,
};

/// The format.
pub(super) const YOLO: FormatSpec = FormatSpec {
    media_type: "text/plain; charset=utf-8",
    boxes: SupportedBoxes::Both,
    layout: Layout::FilePerImage {
        path,
        document,
        others,
    },
};

/// The path of an image's file.
fn path(image_file_name: &str) -> String {
    format!("labels/{}.txt", stem(image_file_name))
}

fn others(_: &[AnnotatedImage]) -> Vec<AnnotationFile> {
    let data = format!("path: .\ntrain: images\nval: images\nnames:\n  0: {LABEL}\n");
    let classes = format!("{LABEL}\n");
    vec![file("data.yaml", data), file("classes.txt", classes)]
}

fn document(image: &AnnotatedImage, boxes: BoxKind) -> String {
    let (width, height) = (f64::from(image.width), f64::from(image.height));
    let mut lines = String::new();
    for ([left, top, right, bottom], person) in image.boxes() {
        // Writing to a string cannot fail.
        let _ = match boxes {
            BoxKind::AxisParallel => writeln!(
                lines,
                "0 {:.6} {:.6} {:.6} {:.6}",
                f64::midpoint(left, right) / width,
                f64::midpoint(top, bottom) / height,
                (right - left) / width,
                (bottom - top) / height,
            ),
            BoxKind::Oriented => {
                let corners = person.oriented_box.corners();
                let corners = corners.map(|corner| [corner.x / width, corner.y / height]);
                writeln!(lines, "0 {}", fractions(corners.as_flattened()))
            }
        };
    }
    lines
}

/// Returns the fractions, each moved to the range of 0 to 1: Ultralytics skips an image with a
/// corner outside it.
fn fractions(corners: &[f64]) -> String {
    let fractions = corners.iter().map(|fraction| fraction.clamp(0.0, 1.0));
    let texts = fractions.map(|fraction| format!("{fraction:.6}"));
    texts.collect::<Vec<_>>().join(" ")
}
