//! `--annotate`: the persons of a report, drawn into their picture.

use std::{fs, path::Path, sync::Arc};

use anyhow::Context;

use crate::{
    imaging::annotate::{Mark, OrientedMark, annotate, encode_jpeg},
    pipeline::{Detected, Person},
};

const JPEG_QUALITY: u8 = 90;

/// Draws the persons and writes a JPEG file.
pub(super) fn write(detected: Detected, path: &Path) -> anyhow::Result<()> {
    let Detected { report, frame } = detected;
    let mut frame = Arc::unwrap_or_clone(frame);
    let marks: Vec<_> = report.persons.iter().map(mark).collect();
    annotate(&mut frame, &marks);
    let picture = encode_jpeg(&frame, JPEG_QUALITY)?;
    fs::write(path, picture)
        .with_context(|| format!("--annotate: {} cannot be written", path.display()))
}

fn mark(person: &Person) -> Mark {
    let oriented = &person.oriented_box;
    Mark {
        bbox: person.bbox.corners(),
        oriented: Some(OrientedMark {
            cx: oriented.center.x,
            cy: oriented.center.y,
            width: oriented.width,
            height: oriented.height,
            angle_deg: oriented.angle.to_degrees(),
        }),
        label: format!("{:.2}", person.score),
    }
}
