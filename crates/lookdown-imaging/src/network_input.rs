//! Network input format, and batches of inputs.

/// Order of the color planes in a network's input.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ChannelOrder {
    /// Red, green, blue.
    #[default]
    Rgb,
    /// Blue, green, red.
    Bgr,
}

/// The input of a network: `[views, 3, height, width]`, `f32`, each value
/// `pixel · scale + offset` with pixels 0 to 255.
#[derive(Debug, Clone, PartialEq)]
pub struct NetworkInput {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Order of the color planes.
    pub channel_order: ChannelOrder,
    /// Factor per plane, in the network's plane order.
    pub scale: [f32; 3],
    /// Offset per plane, in the network's plane order.
    pub offset: [f32; 3],
}

impl NetworkInput {
    /// Unscaled pixels (0 to 255) in RGB planes.
    pub fn plain(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            channel_order: ChannelOrder::Rgb,
            scale: [1.0; 3],
            offset: [0.0; 3],
        }
    }

    /// Returns the shorter side, pixels.
    pub fn shorter_side(&self) -> u32 {
        self.width.min(self.height)
    }

    /// Number of values in one plane of one view.
    pub fn plane_len(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Number of values in one view.
    pub fn view_len(&self) -> usize {
        3 * self.plane_len()
    }

    /// The source channel of each plane of the input: red (0), green (1) or blue (2).
    pub fn source_channels(&self) -> [usize; 3] {
        match self.channel_order {
            ChannelOrder::Rgb => [0, 1, 2],
            ChannelOrder::Bgr => [2, 1, 0],
        }
    }

    /// Converts one view of plain pixels (planes of red, green and blue, 0 to 255) to input values.
    /// Both slices have [`NetworkInput::view_len`] values.
    pub fn fill(&self, slot: &mut [f32], pixels: &[f32]) {
        let planes = slot.chunks_exact_mut(self.plane_len());
        for (plane, (values, channel)) in planes.zip(self.source_channels()).enumerate() {
            let (scale, offset) = (self.scale[plane], self.offset[plane]);
            let source = &pixels[channel * self.plane_len()..];
            for (value, pixel) in values.iter_mut().zip(source) {
                *value = pixel * scale + offset;
            }
        }
    }
}

/// Rendered views as network input: `[views, 3, height, width]`, row-major.
#[derive(Debug, Clone, Default)]
pub struct ViewBatch {
    values: Vec<f32>,
    views: usize,
}

impl ViewBatch {
    /// Allocates memory for `views` views of `input` and returns one slice per view to render into.
    /// The memory is reused by the next batch.
    pub fn prepare(
        &mut self,
        views: usize,
        input: &NetworkInput,
    ) -> std::slice::ChunksExactMut<'_, f32> {
        self.views = views;
        self.values.resize(views * input.view_len(), 0.0);
        self.values.chunks_exact_mut(input.view_len())
    }

    /// Removes the views whose entry in `keep` is false. The others keep their order.
    pub fn retain(&mut self, keep: &[bool]) {
        let view_len = self.values.len() / self.views.max(1);
        let mut kept = 0;
        for (view, _) in keep.iter().enumerate().filter(|(_, keep)| **keep) {
            let values = view * view_len..(view + 1) * view_len;
            self.values.copy_within(values, kept * view_len);
            kept += 1;
        }
        self.values.truncate(kept * view_len);
        self.views = kept;
    }

    /// Number of views.
    pub fn views(&self) -> usize {
        self.views
    }

    /// The values, `[views, 3, height, width]`, row-major.
    pub fn values(&self) -> &[f32] {
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_pixels_are_normalized_in_the_networks_plane_order() {
        let input = NetworkInput {
            channel_order: ChannelOrder::Bgr,
            scale: [2.0, 1.0, 0.5],
            offset: [0.0, 1.0, -1.0],
            ..NetworkInput::plain(2, 1)
        };
        let mut slot = [0.0; 6];
        input.fill(&mut slot, &[10.0, 20.0, 30.0, 40.0, 50.0, 60.0]);
        assert_eq!(slot, [100.0, 120.0, 31.0, 41.0, 4.0, 9.0]);
    }
}
