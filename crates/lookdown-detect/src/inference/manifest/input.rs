//! The `[input]` table: conversion of pixels to network input.

use std::num::NonZeroU32;

use serde::Deserialize;
use strum::Display;

use lookdown_imaging::ChannelOrder;

/// Conversion of pixels to network input. With pixels 0 to 255, each value is either
/// `pixel · scale + offset` or `(pixel − mean) / std`, per plane in the network's plane order.
///
/// ```toml
/// [input]                    # optional
/// name = "images"            # default: the model's only input
/// width = 640                # required if the model leaves it open
/// height = 640
/// stride = 32                # sides of open models must be multiples of it
/// batch = 1                  # for models that wrongly declare any number of views
/// layout = "nchw"            # or "nhwc"; default: from the axis with the 3 planes
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
    /// The input that takes the image. Default: the only one.
    pub name: Option<String>,
    /// Width, pixels. Required if the model leaves it open.
    pub width: Option<NonZeroU32>,
    /// Height, pixels. Required if the model leaves it open.
    pub height: Option<NonZeroU32>,
    /// Divisor of the input sides, in pixels, for models that leave the sides open.
    pub stride: Option<NonZeroU32>,
    /// Views per run, for models that leave it open. Default: any number.
    pub batch: Option<NonZeroU32>,
    /// Order of the axes, for models that leave them open.
    pub layout: Option<Layout>,
    /// Order of the color planes.
    pub channel_order: ChannelOrder,
    /// Factor per plane.
    pub scale: Option<[f32; 3]>,
    /// Offset per plane.
    pub offset: Option<[f32; 3]>,
    /// Value subtracted per plane.
    pub mean: Option<[f32; 3]>,
    /// Divisor per plane, applied after the subtraction.
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
    /// One sentence when both pairs are used at once, a number is not finite or a divisor is 0.
    pub(in crate::inference) fn normalization(&self) -> Result<([f32; 3], [f32; 3]), String> {
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
