//! Visibility of the lens image in the pixels of a view.

use std::ops::Range;

use lookdown_lens::geometry::{Lens, Pixel, VirtualView};

use super::block_size::LANES;

/// In each row of a view one span of pixels, which meets a cone about the optical axis: what the
/// lens sees, or, where that is more than a half space, what it does not.
#[derive(Debug)]
pub(super) struct Visibility {
    /// For each row, the first pixel of its span and the first one after it.
    pub(super) spans: Vec<[u32; 2]>,
    pub(super) spans_are_hidden: bool,
}

/// One row of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowVisibility {
    start: u32,
    end: u32,
    is_hidden: bool,
}

impl Visibility {
    /// A ray lies within `max_theta` of the optical axis where `z − cos(max_theta) |ray| >= 0`.
    /// Along a row of pixels `z` is linear and `|ray|` convex, so that the left side (its negative
    /// for a negative cosine) rises to one peak and falls: the span lies around the peak.
    pub(super) fn new(view: &VirtualView, lens: &Lens) -> Self {
        let least_cosine = lens.max_theta().cos();
        let spans_are_hidden = least_cosine < 0.0;
        let span = |y: u32| {
            let margin = |x: u32| {
                let ray = view.ray_in_camera(&Pixel::new(f64::from(x), f64::from(y)));
                let margin = ray.z - least_cosine * ray.norm();
                if spans_are_hidden { -margin } else { margin }
            };
            let is_in_span = |x: u32| {
                let margin = margin(x);
                margin > 0.0 || (margin == 0.0 && !spans_are_hidden)
            };
            let peak = first(0, view.width - 1, |x| margin(x + 1) <= margin(x));
            if !is_in_span(peak) {
                return [0, 0];
            }
            [
                first(0, peak, is_in_span),
                first(peak, view.width, |x| !is_in_span(x)),
            ]
        };
        Self {
            spans: (0..view.height).map(span).collect(),
            spans_are_hidden,
        }
    }

    /// Every pixel of a view of `width` × `height` pixels.
    pub(super) fn everywhere([width, height]: [u32; 2]) -> Self {
        Self {
            spans: vec![[0, width]; height as usize],
            spans_are_hidden: false,
        }
    }

    pub(super) fn row(&self, y: usize) -> RowVisibility {
        let [start, end] = self.spans[y];
        RowVisibility {
            start,
            end,
            is_hidden: self.spans_are_hidden,
        }
    }

    /// Number of bands of eight rows in the view. The last one may have fewer rows.
    pub(super) fn bands(&self) -> usize {
        self.spans.len().div_ceil(LANES)
    }

    /// The view's rows that a band has.
    pub(super) fn rows_of_band(&self, band: usize) -> Range<usize> {
        band * LANES..self.spans.len().min((band + 1) * LANES)
    }

    /// Memory held, bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(self.spans.as_slice())
    }
}

impl RowVisibility {
    /// The pixels, of the eight from `first_pixel` on, that show the lens image, the first one in
    /// the lowest bit. Bits for pixels beyond the view's right border are undefined.
    pub(super) fn lanes(self, first_pixel: u32) -> u8 {
        let lanes_before = |end: u32| end.saturating_sub(first_pixel).min(8);
        let (start, end) = (lanes_before(self.start), lanes_before(self.end));
        let in_span = if (start, end) == (0, 8) {
            // As almost always.
            u8::MAX
        } else {
            let below = |lane: u32| (1_u32 << lane) - 1;
            let [in_span, ..] = (below(end) & !below(start)).to_le_bytes();
            in_span
        };
        if self.is_hidden { !in_span } else { in_span }
    }
}

/// The first number from `start` to below `end` for which `holds`, or `end`; once it holds it
/// goes on to.
fn first(start: u32, end: u32, holds: impl Fn(u32) -> bool) -> u32 {
    let (mut low, mut high) = (start, end);
    while low < high {
        let middle = low.midpoint(high);
        if holds(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use lookdown_lens::geometry::{Mount, Ray};
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_says_what_the_lens_says(
            max_theta in 0.2..3.1,
            axis in prop::array::uniform3(-1.0..1.0_f64),
            focal in 5.0..60.0,
        ) {
            let axis = Ray::from(axis);
            prop_assume!(axis.norm() > 0.1);
            let lens = Lens::equidistant_circle(0.0, 0.0, 100.0, max_theta).unwrap();
            let view = VirtualView::looking_along(&axis, focal, &Mount::default(), 45, 33);
            let visibility = Visibility::new(&view, &lens);
            for y in 0..33_u32 {
                for x in 0..45_u32 {
                    let lanes = visibility.row(y as usize).lanes(x / 8 * 8);
                    let ray = view.ray_in_camera(&Pixel::new(f64::from(x), f64::from(y)));
                    let is_visible = lanes >> (x % 8) & 1 == 1;
                    prop_assert_eq!(is_visible, lens.project(&ray).is_some(), "({}, {})", x, y);
                }
            }
        }
    }
}
