//! Frame crops: upright cut-outs of the fisheye frame, turned by a multiple of 90°, scaled, and
//! mirrored if wanted.
//!
//! Quarter turns and mirroring map axis-parallel boxes to axis-parallel boxes. The footprint of a
//! box that was found in a crop is therefore exact; `docs/geometry.md` compares it with that of a
//! virtual view.

use nalgebra::Vector2;

use super::Pixel;

/// A clockwise rotation by a multiple of 90°.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum QuarterTurn {
    /// Up in the crop is up in the frame.
    None,
    /// Up in the crop is right in the frame.
    Right,
    /// Up in the crop is down in the frame.
    Half,
    /// Up in the crop is left in the frame.
    Left,
}

impl QuarterTurn {
    /// Every quarter turn, clockwise.
    pub const ALL: [Self; 4] = [Self::None, Self::Right, Self::Half, Self::Left];

    /// The quarter turn whose up is closest to `up` (frame pixels, any length).
    pub fn nearest(up: Vector2<f64>) -> Self {
        match (up.x.abs() > up.y.abs(), up.x > 0.0, up.y > 0.0) {
            (true, true, _) => Self::Right,
            (true, false, _) => Self::Left,
            (false, _, true) => Self::Half,
            (false, _, false) => Self::None,
        }
    }

    /// The direction in the frame that is up in the crop.
    pub fn up(self) -> Vector2<f64> {
        self.turned(-Vector2::y())
    }

    /// A vector of the crop as a vector of the frame. Exact: no value is rounded.
    pub fn turned(self, vector: Vector2<f64>) -> Vector2<f64> {
        let (x, y) = (vector.x, vector.y);
        match self {
            Self::None => Vector2::new(x, y),
            Self::Right => Vector2::new(-y, x),
            Self::Half => Vector2::new(-x, -y),
            Self::Left => Vector2::new(y, -x),
        }
    }

    /// The turn back.
    pub fn inverse(self) -> Self {
        match self {
            Self::Right => Self::Left,
            Self::Left => Self::Right,
            same => same,
        }
    }
}

/// A crop of `width` × `height` pixels. Positions in the crop and in the frame are corner-origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameCrop {
    /// The direction of up.
    pub turn: QuarterTurn,
    /// True if left and right are exchanged in the crop.
    pub is_mirrored: bool,
    /// The position in the frame of the middle of the crop.
    pub center: Pixel,
    /// Crop pixels per frame pixel.
    pub scale: f64,
    /// Width, crop pixels.
    pub width: u32,
    /// Height, crop pixels.
    pub height: u32,
}

impl FrameCrop {
    /// The position in the frame of a position in the crop.
    pub fn frame_from_crop(&self, position: &Pixel) -> Pixel {
        let offset = self.mirrored_back((position - self.middle()) / self.scale);
        self.center + self.turn.turned(offset)
    }

    /// The position in the crop of a position in the frame.
    pub fn crop_from_frame(&self, position: &Pixel) -> Pixel {
        let offset = self.turn.inverse().turned(position - self.center);
        self.middle() + self.mirrored_back(offset) * self.scale
    }

    /// The crop of the same part of the frame with left and right exchanged.
    pub fn mirrored(&self) -> Self {
        Self {
            is_mirrored: !self.is_mirrored,
            ..*self
        }
    }

    /// The box in the frame of a box in the crop, both `[x_min, y_min, x_max, y_max]`.
    pub fn frame_box(&self, crop_box: [f64; 4]) -> [f64; 4] {
        mapped(crop_box, |corner| self.frame_from_crop(corner))
    }

    /// The box in the crop of a box in the frame, both `[x_min, y_min, x_max, y_max]`.
    pub fn crop_box(&self, frame_box: [f64; 4]) -> [f64; 4] {
        mapped(frame_box, |corner| self.crop_from_frame(corner))
    }

    /// The part of the frame's plane that the crop shows, also beyond the frame's borders.
    pub fn bounds(&self) -> [f64; 4] {
        self.frame_box([0.0, 0.0, f64::from(self.width), f64::from(self.height)])
    }

    /// Returns true when a position in the frame lies in the crop.
    pub fn holds(&self, position: &Pixel) -> bool {
        let Pixel { coords } = self.crop_from_frame(position);
        (0.0..=f64::from(self.width)).contains(&coords.x)
            && (0.0..=f64::from(self.height)).contains(&coords.y)
    }

    /// A vector of the crop without the exchange of left and right. It is its own inverse.
    fn mirrored_back(&self, vector: Vector2<f64>) -> Vector2<f64> {
        if self.is_mirrored {
            Vector2::new(-vector.x, vector.y)
        } else {
            vector
        }
    }

    fn middle(&self) -> Pixel {
        Pixel::new(f64::from(self.width) / 2.0, f64::from(self.height) / 2.0)
    }
}

/// The bounds of a box's mapped corners; two opposite ones determine it, as axes stay axes.
fn mapped([x_min, y_min, x_max, y_max]: [f64; 4], map: impl Fn(&Pixel) -> Pixel) -> [f64; 4] {
    let one = map(&Pixel::new(x_min, y_min));
    let other = map(&Pixel::new(x_max, y_max));
    [
        one.x.min(other.x),
        one.y.min(other.y),
        one.x.max(other.x),
        one.y.max(other.y),
    ]
}

#[cfg(test)]
mod tests;
