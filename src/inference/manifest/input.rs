//! The `[input]` table: how pixels become network input.

use std::num::NonZeroU32;

use serde::Deserialize;
use strum::Display;

use crate::imaging::ChannelOrder;

/// How pixels become network input. With pixels 0 to 255, each value is either
/// `pixel · scale + offset` or `(pixel − mean) / std`, per plane in the network's plane order.
///
/// ```toml
/// [input]                    # may be left out altogether
/// name = "images"            # default: the model's only input
/// width = 640                # needed where the model leaves it open
/// height = 640
/// stride = 32                # sides of open models must be multiples of it
/// batch = 1                  # for models that only claim to take any number of views
/// layout = "nchw"            # or "nhwc"; default: told by where the 3 planes are
/// channel_order = "rgb"      # default; or "bgr"
/// scale = [0.00392156863, 0.00392156863, 0.00392156863]   # default: ones
/// offset = [0.0, 0.0, 0.0]                                # default: zeros
/// # or, instead of scale and offset:
/// # mean = [123.675, 116.28, 103.53]
/// # std = [58.395, 57.12, 57.375]
/// ```
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ManifestInput {
    /// The input that takes the picture; by default the only one.
    pub name: Option<String>,
    /// Width, pixels; told by the model unless it leaves it open.
    pub width: Option<NonZeroU32>,
    /// Height, pixels; told by the model unless it leaves it open.
    pub height: Option<NonZeroU32>,
    /// What the sides of a model that leaves them open must be multiples of, pixels.
    pub stride: Option<NonZeroU32>,
    /// Views per run; told by the model unless it leaves it open, and then any number.
    pub batch: Option<NonZeroU32>,
    /// The order of the axes; told by the model unless it leaves them open.
    pub layout: Option<Layout>,
    /// Order of the colour planes.
    pub channel_order: ChannelOrder,
    /// Factor per plane.
    pub scale: Option<[f32; 3]>,
    /// Offset per plane.
    pub offset: Option<[f32; 3]>,
    /// What is subtracted per plane.
    pub mean: Option<[f32; 3]>,
    /// What is divided by per plane, then.
    pub std: Option<[f32; 3]>,
}

/// The order of an input's axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Display)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Layout {
    /// `[views, 3, height, width]`
    Nchw,
    /// `[views, height, width, 3]`
    Nhwc,
}

impl ManifestInput {
    /// Factor and offset per plane.
    ///
    /// # Errors
    /// One sentence when both ways are used at once, or a number is none or a divisor is 0.
    pub(in crate::inference) fn normalisation(&self) -> Result<([f32; 3], [f32; 3]), String> {
        let one_way = self.scale.is_some() || self.offset.is_some();
        let other_way = self.mean.is_some() || self.std.is_some();
        if one_way && other_way {
            return Err("[input] has scale or offset as well as mean or std: use one pair".into());
        }
        let (scale, offset) = if other_way {
            let mean = self.mean.unwrap_or([0.0; 3]);
            let std = self.std.unwrap_or([1.0; 3]);
            let scale = std.map(|std| 1.0 / std);
            (
                scale,
                std::array::from_fn(|plane| -mean[plane] / std[plane]),
            )
        } else {
            (
                self.scale.unwrap_or([1.0; 3]),
                self.offset.unwrap_or([0.0; 3]),
            )
        };
        let usable = scale
            .iter()
            .all(|factor| factor.is_finite() && *factor != 0.0)
            && offset.iter().all(|offset| offset.is_finite());
        if !usable {
            return Err("[input] has a scale or std of 0, or a number that is not finite".into());
        }
        Ok((scale, offset))
    }
}
