//! A checked calibration, and its fit to frames of other sizes.

use super::{Areas, CalibrationId};
use lookdown_lens::geometry::{Lens, Mount, Pixel, SitePlacement};

/// A frame's height may differ by this from the calibration's aspect, pixels.
const ASPECT_TOLERANCE: f64 = 1.0;

/// A camera's calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    pub(crate) id: CalibrationId,
    pub(crate) revision: String,
    pub(crate) image_width: u32,
    pub(crate) image_height: u32,
    pub(crate) lens: Lens,
    pub(crate) mount: Mount,
    pub(crate) areas: Areas,
    pub(crate) site: Option<SitePlacement>,
}

/// A calibration fitted to the frames at hand.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraGeometry {
    /// The lens, in pixels of the frame.
    pub lens: Lens,
    /// The mount of the camera.
    pub mount: Mount,
    /// Its zones, lines and masks, in pixels of the frame.
    pub areas: Areas,
}

/// A frame of another aspect than its calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameSizeMismatch {
    /// Width the calibration was made for, pixels.
    pub image_width: u32,
    /// Height the calibration was made for, pixels.
    pub image_height: u32,
}

impl Calibration {
    /// The calibration's ID.
    pub fn id(&self) -> &CalibrationId {
        &self.id
    }

    /// Changes whenever the content of the file does.
    pub fn revision(&self) -> &str {
        &self.revision
    }

    /// Width and height of the frames the calibration was made for, pixels.
    pub fn image_size(&self) -> (u32, u32) {
        (self.image_width, self.image_height)
    }

    /// The lens, in pixels of frames of [`Calibration::image_size`].
    pub fn lens(&self) -> &Lens {
        &self.lens
    }

    /// The mount of the camera.
    pub fn mount(&self) -> &Mount {
        &self.mount
    }

    /// The place of the camera on the floor of a site, if it has one.
    pub fn site(&self) -> Option<&SitePlacement> {
        self.site.as_ref()
    }

    /// Its zones, lines and masks, in pixels of frames of [`Calibration::image_size`].
    pub fn areas(&self) -> &Areas {
        &self.areas
    }

    /// The camera for frames of `width` × `height` pixels.
    ///
    /// # Errors
    /// [`FrameSizeMismatch`] when the frame has another aspect than the calibration.
    pub fn for_frame(&self, width: u32, height: u32) -> Result<CameraGeometry, FrameSizeMismatch> {
        let scale_x = f64::from(width) / f64::from(self.image_width);
        let scale_y = f64::from(height) / f64::from(self.image_height);
        let expected_height = f64::from(self.image_height) * scale_x;
        if (expected_height - f64::from(height)).abs() > ASPECT_TOLERANCE {
            return Err(FrameSizeMismatch {
                image_width: self.image_width,
                image_height: self.image_height,
            });
        }
        Ok(CameraGeometry {
            lens: self.lens.scaled(scale_x, scale_y),
            mount: self.mount,
            areas: self.areas.scaled(scale_x, scale_y),
        })
    }

    /// The calibration with its lens image ending at the farthest corner of the frame.
    pub(super) fn limited_to_image(self) -> Self {
        let right = f64::from(self.image_width) - 0.5;
        let bottom = f64::from(self.image_height) - 0.5;
        let corners = [(-0.5, -0.5), (right, -0.5), (-0.5, bottom), (right, bottom)];
        let farthest = corners
            .iter()
            .map(|&(x, y)| match self.lens.unproject(&Pixel::new(x, y)) {
                Some(ray) => ray.x.hypot(ray.y).atan2(ray.z),
                None => self.lens.max_theta(),
            })
            .fold(0.0, f64::max);
        Self {
            lens: self.lens.limited_to(farthest),
            ..self
        }
    }
}

#[cfg(test)]
mod tests;
