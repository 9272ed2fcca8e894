//! Construction and access of frames.

use lookdown_imaging::Frame;

#[test]
fn pixels_are_rows_of_red_green_and_blue_from_the_top() {
    let frame = Frame::new(2, 3, (0..18).collect()).unwrap();
    assert_eq!((frame.width(), frame.height()), (2, 3));
    assert_eq!(frame.pixel(0, 0), [0, 1, 2]);
    assert_eq!(frame.pixel(1, 0), [3, 4, 5]);
    assert_eq!(frame.pixel(1, 2), [15, 16, 17]);
}

#[test]
fn a_frame_without_pixels_is_refused() {
    for (width, height) in [(0, 4), (4, 0), (0, 0)] {
        assert_eq!(
            Frame::new(width, height, Vec::new())
                .unwrap_err()
                .to_string(),
            format!(
                "a frame of {width}×{height} pixels has no pixels; both sides must be at least 1"
            )
        );
    }
}

#[test]
fn bytes_that_do_not_fit_the_size_are_refused_in_one_sentence() {
    assert_eq!(
        Frame::new(2, 2, vec![0; 16]).unwrap_err().to_string(),
        "a frame of 2×2 pixels takes width × height × 3 bytes of RGB, not 16"
    );
    assert!(Frame::new(u32::MAX, u32::MAX, vec![0; 3]).is_err());
}

#[test]
#[should_panic(expected = "pixel (2, 0) lies outside a frame of 2×1")]
fn a_pixel_outside_the_frame_panics() {
    let _ = Frame::new(2, 1, vec![0; 6]).unwrap().pixel(2, 0);
}
