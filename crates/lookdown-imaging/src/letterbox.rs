//! The whole frame as one network input: scaled to fit, with the rest filled gray.

use image::{RgbImage, imageops};
use lookdown_lens::saturating::to_u32;

use super::{Frame, NetworkInput};

/// Value of the unused part of the input (0 to 255), the same as in the detectors' training.
const FILL: f32 = 114.0;

/// Scales frames to fit a network's input, top-left aligned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Letterbox {
    scale: f64,
    width: u32,
    height: u32,
}

impl Letterbox {
    /// The letterbox for frames of `frame_width` × `frame_height` pixels.
    pub fn new(frame_width: u32, frame_height: u32, input: &NetworkInput) -> Self {
        let scale = (f64::from(input.width) / f64::from(frame_width))
            .min(f64::from(input.height) / f64::from(frame_height));
        let scaled = |side: u32| to_u32((f64::from(side) * scale).round()).max(1);
        Self {
            scale,
            width: scaled(frame_width).min(input.width),
            height: scaled(frame_height).min(input.height),
        }
    }

    /// Scales `frame` into one view's slot `[3, height, width]` of the network's input.
    pub fn render(&self, frame: &Frame, input: &NetworkInput, slot: &mut [f32]) {
        let view = image::FlatSamples {
            samples: frame.pixels(),
            layout: image::flat::SampleLayout::row_major_packed(3, frame.width(), frame.height()),
            color_hint: None,
        };
        let Ok(whole) = view.as_view::<image::Rgb<u8>>() else {
            unreachable!("a frame is packed RGB by construction")
        };
        let scaled: RgbImage = imageops::resize(
            &whole,
            self.width,
            self.height,
            imageops::FilterType::Triangle,
        );
        for (plane, channel) in input.source_channels().into_iter().enumerate() {
            let (scale, offset) = (input.scale[plane], input.offset[plane]);
            let values = &mut slot[plane * input.plane_len()..(plane + 1) * input.plane_len()];
            values.fill(FILL * scale + offset);
            let rows = values.chunks_exact_mut(input.width as usize);
            for (row, pixels) in rows.zip(scaled.rows()) {
                for (value, pixel) in row.iter_mut().zip(pixels) {
                    *value = f32::from(pixel.0[channel]) * scale + offset;
                }
            }
        }
    }

    /// Maps an input position to the frame (corner-origin, pixels).
    pub fn frame_from_input(&self, position: f64) -> f64 {
        position / self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_frame_fills_one_side_and_the_rest_is_gray() {
        let frame = Frame::new(40, 20, vec![200; 40 * 20 * 3]).unwrap();
        let input = NetworkInput::plain(10, 10);
        let letterbox = Letterbox::new(40, 20, &input);
        let mut slot = vec![0.0; input.view_len()];
        letterbox.render(&frame, &input, &mut slot);
        for plane in slot.chunks_exact(100) {
            assert!(plane[..50].iter().all(|&value| value == 200.0));
            assert!(plane[50..].iter().all(|&value| value == FILL));
        }
        assert_eq!(letterbox.frame_from_input(10.0), 40.0);
    }
}
