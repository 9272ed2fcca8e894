//! Reads a calibration file of any format and prints the directions of pixels:
//! `cargo run -p lookdown-lens --example unproject -- camchain.yaml 960 540 1200 300`

use std::{env, error::Error, path::PathBuf};

use lookdown_calibration::Calibration;
use lookdown_lens::geometry::Pixel;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let usage = "usage: unproject FILE X Y [X Y ...]";
    let path = PathBuf::from(arguments.next().ok_or(usage)?);
    let coordinates: Vec<f64> = arguments
        .map(|text| text.parse())
        .collect::<Result<_, _>>()?;
    let calibration = Calibration::read(&path)?;
    let lens = calibration.lens();
    let (width, height) = calibration.image_size();
    println!(
        "{}: {} lens, {width}×{height} pixels, {:.1}° from the axis at most",
        calibration.id(),
        lens.model(),
        lens.max_theta().to_degrees()
    );
    for xy in coordinates.chunks_exact(2) {
        match lens.unproject(&Pixel::new(xy[0], xy[1])) {
            Some(ray) => println!(
                "({}, {}) → ({:.6}, {:.6}, {:.6}), {:.3}° from the axis",
                xy[0],
                xy[1],
                ray.x,
                ray.y,
                ray.z,
                ray.z.acos().to_degrees()
            ),
            None => println!("({}, {}) → outside of the lens image", xy[0], xy[1]),
        }
    }
    Ok(())
}
