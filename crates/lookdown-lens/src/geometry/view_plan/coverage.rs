//! Coverage of the lens image by views.

use super::super::{Lens, Pixel, VirtualView};

/// Sample points along each side of the frame.
const SAMPLES: u32 = 160;

/// The share of a lens image that some views see, by area of the frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coverage {
    /// Share of the lens image that lies in at least one view, 0 to 1.
    pub seen_share: f64,
    /// In how many views a place of the lens image lies on average.
    pub mean_views: f64,
}

impl Coverage {
    /// Measures `views` on a frame of `width` × `height` pixels, at points of a regular grid.
    pub fn new(lens: &Lens, views: &[VirtualView], width: u32, height: u32) -> Self {
        let position = |index: u32, side: u32| {
            (f64::from(index) + 0.5) / f64::from(SAMPLES) * f64::from(side) - 0.5
        };
        let (mut inside, mut seen, mut sightings) = (0_u32, 0_u32, 0_u32);
        for row in 0..SAMPLES {
            for column in 0..SAMPLES {
                let pixel = Pixel::new(position(column, width), position(row, height));
                let Some(ray) = lens.unproject(&pixel) else {
                    continue;
                };
                let holding: u32 = views.iter().map(|view| u32::from(view.holds(&ray))).sum();
                inside += 1;
                seen += u32::from(holding > 0);
                sightings += holding;
            }
        }
        let of_inside = |count: u32| f64::from(count) / f64::from(inside.max(1));
        Self {
            seen_share: of_inside(seen),
            mean_views: of_inside(sightings),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Mount, ViewPlan};

    #[test]
    fn wider_lenses_leave_more_beyond_the_plan() {
        let views = ViewPlan::balanced().views(&Mount::default(), 416, 416);
        let coverage = |max_theta: f64| {
            let lens = Lens::equidistant_circle(499.5, 499.5, 500.0, max_theta);
            Coverage::new(&lens.expect("a plausible lens"), &views, 1000, 1000)
        };
        let (narrow, wide) = (coverage(1.2), coverage(3.0));
        assert!(narrow.seen_share > 0.999, "{narrow:?}");
        assert!(wide.seen_share < 0.6, "{wide:?}");
        assert!(narrow.mean_views > wide.mean_views);
        let none = Coverage::new(
            &Lens::equidistant_circle(499.5, 499.5, 500.0, 1.2).expect("a plausible lens"),
            &[],
            1000,
            1000,
        );
        assert_eq!((none.seen_share, none.mean_views), (0.0, 0.0));
    }
}
