//! Projects points through a camera of a Kalibr file: `program CAMCHAIN CAMERA`.

use std::{env, error::Error, fs};

use lookdown_calibration::CalibrationFile;
use lookdown_lens::geometry::Ray;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let usage = "usage: program CAMCHAIN CAMERA";
    let (path, camera) = (
        arguments.next().ok_or(usage)?,
        arguments.next().ok_or(usage)?,
    );
    let content = fs::read(path)?;
    let file = CalibrationFile::parse(&content)?;
    let cameras = file.calibrations("kalibr", &content);
    let (_, calibration) = cameras
        .into_iter()
        .find(|(id, _)| *id == camera)
        .ok_or("there is no such camera")?;
    let calibration = calibration?;
    for degrees in [0.0_f64, 30.0, 60.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let pixel = calibration
            .lens()
            .project(&Ray::new(sin, 0.0, cos))
            .ok_or("beyond the lens")?;
        println!("{} {}", pixel.x, pixel.y);
    }
    Ok(())
}
