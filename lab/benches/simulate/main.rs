//! Simulates walks under ceiling cameras and follows them: truth, detections, tracks and crossings
//! as JSON lines for lab/benches/count/score.py.
//!
//!     simulate --rate 5 --seed 1 --seconds 300 --persons 8 --detector rendered [--site] [--follow]
#![allow(missing_docs, reason = "a program of the laboratory")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a program of the laboratory may stop"
)]

mod chance;
mod detector;
mod figures;
mod follow;
mod people;
mod scene;

use std::io::Write;

use scene::{Options, Scene};

fn main() {
    let options = Options::from_arguments(std::env::args().skip(1));
    let mut output = std::io::BufWriter::new(std::io::stdout().lock());
    let mut scene = Scene::new(&options);
    while let Some(frame) = scene.next_frame() {
        writeln!(output, "{frame}").expect("standard output takes a line");
    }
    writeln!(output, "{}", scene.crossings()).expect("standard output takes a line");
}
