//! From the plane that the views of a ring share to the frame of one of them.

use std::array;

use lookdown_lens::geometry::lens::ImagePlane;

/// An affine map in the precision in which nodes are kept.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrameFromPlane {
    x: [f32; 3],
    y: [f32; 3],
}

impl FrameFromPlane {
    /// The identity, for nodes that are pixels of the frame.
    pub(super) fn identity() -> Self {
        Self {
            x: [1.0, 0.0, 0.0],
            y: [0.0, 1.0, 0.0],
        }
    }

    /// A turn by `turn` radians (clockwise on the screen), then `image_plane`.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "24 bits tell 1/1000 of a pixel in a frame of 8000"
    )]
    pub(super) fn new(image_plane: &ImagePlane, turn: f64) -> Self {
        let (sin, cos) = turn.sin_cos();
        let row = |x: f64, y: f64, offset: f64| {
            [x * cos + y * sin, y * cos - x * sin, offset].map(|value| value as f32)
        };
        Self {
            x: row(image_plane.fx, image_plane.skew, image_plane.cx),
            y: row(image_plane.row_skew, image_plane.fy, image_plane.cy),
        }
    }

    /// The frame's pixel (pixel centers) at a place of the plane.
    pub(super) fn pixel_at(&self, [x, y]: [f32; 2]) -> [f32; 2] {
        self.pixels_at(&[x], &[y]).map(|[coordinate]| coordinate)
    }

    /// Columns and rows of the frame's pixels (pixel centers) at some places of the plane.
    #[expect(
        clippy::inline_always,
        reason = "this becomes vector code only within a function that may use it"
    )]
    #[inline(always)]
    pub(super) fn pixels_at<const N: usize>(&self, x: &[f32; N], y: &[f32; N]) -> [[f32; N]; 2] {
        [self.x, self.y].map(|[of_x, of_y, offset]| {
            array::from_fn(|place| of_x * x[place] + of_y * y[place] + offset)
        })
    }
}
