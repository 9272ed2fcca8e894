use super::*;

fn calibration() -> Calibration {
    let lens = Lens::equidistant_circle(399.5, 299.5, 300.0, 1.5).unwrap();
    Calibration {
        id: "yard".parse().unwrap(),
        revision: String::new(),
        image_width: 800,
        image_height: 600,
        lens,
        mount: Mount::default(),
        areas: Areas::default(),
        site: None,
    }
}

#[test]
fn frames_of_the_same_aspect_are_scaled() {
    let camera = calibration().for_frame(1600, 1200).unwrap();
    assert_eq!(camera.lens.principal_point(), Pixel::new(799.5, 599.5));
    // One pixel of rounding by the program that scaled the frame is accepted.
    assert!(calibration().for_frame(401, 300).is_ok());
}

#[test]
fn frames_of_another_aspect_are_refused_with_the_size_wanted() {
    let mismatch = calibration().for_frame(600, 600).unwrap_err();
    assert_eq!((mismatch.image_width, mismatch.image_height), (800, 600));
}
