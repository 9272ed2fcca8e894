//! Detects the persons in an image, with its calibration if there is one: `cargo run -p
//! lookdown-detect --example find_persons -- samples/office.jpg samples/calibrations/office.json`

use std::{env, error::Error, fs, path::Path, sync::Arc};

use lookdown_calibration::Calibration;
use lookdown_detect::{Detector, DetectorOptions, parameters::DetectParameters};
use lookdown_imaging::decode::{DecodeLimits, decode};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = env::args().skip(1);
    let path = arguments
        .next()
        .ok_or("usage: find_persons IMAGE [CALIBRATION]")?;
    let camera = arguments.next();
    let camera = camera
        .map(|path| Calibration::read(Path::new(&path)).map(Arc::new))
        .transpose()?;
    let frame = decode(&fs::read(path)?, &DecodeLimits::default())?.frame;
    let parameters = DetectParameters::parse([("profile", "balanced")])?;
    let detector = Detector::new(&DetectorOptions::default())?;
    let found = detector.detect(Arc::new(frame), camera, &parameters)?;
    for warning in &found.warnings {
        eprintln!("{}", warning.message);
    }
    for person in &found.persons {
        let [x_min, y_min, x_max, y_max] = person.bbox.corners();
        println!(
            "{:.2}  {x_min:.0}, {y_min:.0} to {x_max:.0}, {y_max:.0}",
            person.score
        );
    }
    Ok(())
}
