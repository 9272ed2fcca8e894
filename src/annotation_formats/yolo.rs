//! YOLO: a text file per image in `labels/`, each line `class cx cy width height` relative to the
//! image's sides, with `data.yaml` (Ultralytics) and `classes.txt` (Label Studio) next to them. The
//! images belong in `images/`.

use std::fmt::Write;

use super::{AnnotatedImage, AnnotationFile, FormatSpec, LABEL, Layout, file, stem};

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "text/plain; charset=utf-8",
    has_oriented_boxes: false,
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

fn others() -> Vec<AnnotationFile> {
    let data = format!("path: .\ntrain: images\nval: images\nnames:\n  0: {LABEL}\n");
    let classes = format!("{LABEL}\n");
    vec![file("data.yaml", data), file("classes.txt", classes)]
}

fn document(image: &AnnotatedImage) -> String {
    let (width, height) = (f64::from(image.width), f64::from(image.height));
    let mut lines = String::new();
    for ([left, top, right, bottom], _) in image.boxes() {
        // Writing to a string cannot fail.
        let _ = writeln!(
            lines,
            "0 {:.6} {:.6} {:.6} {:.6}",
            f64::midpoint(left, right) / width,
            f64::midpoint(top, bottom) / height,
            (right - left) / width,
            (bottom - top) / height,
        );
    }
    lines
}
