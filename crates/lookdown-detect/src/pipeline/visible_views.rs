//! The views of a plan that can show a person who counts, and why the others are left out.

use std::sync::Arc;

use lookdown_calibration::CameraGeometry;
use lookdown_lens::geometry::{Pixel, foot_filter::AreaReach};

use lookdown_imaging::{MaskedPixels, RemapTable};

/// The pixels of a frame that show no person who counts.
#[derive(Debug, Clone)]
pub(super) struct Hidden {
    pub(super) masked: Arc<MaskedPixels>,
    /// The pixels that can show a person of the areas; `None` without areas.
    pub(super) reach: Option<Arc<AreaReach>>,
}

impl Hidden {
    pub(super) fn new(geometry: &CameraGeometry, width: u32, height: u32) -> Self {
        let CameraGeometry { lens, mount, areas } = geometry;
        let reach = AreaReach::new(&areas.foot_filter, lens, mount, width, height);
        Self {
            masked: Arc::new(MaskedPixels::new(&areas.masks, width, height)),
            reach: reach.map(Arc::new),
        }
    }

    /// Returns true if a view shows an unmasked pixel that can show a person of the areas.
    fn leaves_something(&self, table: &RemapTable) -> bool {
        let Some(reach) = &self.reach else {
            return true;
        };
        table.sees_pixel(|x, y| {
            reach.holds(Pixel::new(f64::from(x) + 0.5, f64::from(y) + 0.5))
                && !self.masked.hides(x, y)
        })
    }
}

/// The numbers of planned views that the network does not process.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct LeftOut {
    /// Views outside the lens image.
    pub(super) outside: usize,
    /// Views whose part of the lens image is wholly masked.
    pub(super) masked: usize,
    /// Views that cannot show a person in an area.
    pub(super) outside_areas: usize,
}

impl LeftOut {
    /// Returns the sums.
    pub(super) fn and(self, other: Self) -> Self {
        Self {
            outside: self.outside + other.outside,
            masked: self.masked + other.masked,
            outside_areas: self.outside_areas + other.outside_areas,
        }
    }
}

/// The views that can show a person, and the numbers of the others.
pub(super) struct Visible<V> {
    pub(super) views: Vec<(V, RemapTable)>,
    pub(super) left_out: LeftOut,
}

impl<V> Visible<V> {
    pub(super) fn new(planned: impl Iterator<Item = (V, RemapTable)>, hidden: &Hidden) -> Self {
        let mut views = Vec::new();
        let mut left_out = LeftOut::default();
        let masked = &hidden.masked;
        for (view, table) in planned {
            if !table.sees_anything() {
                left_out.outside += 1;
            } else if !masked.is_empty() && !table.sees_beside(masked) {
                left_out.masked += 1;
            } else if !hidden.leaves_something(&table) {
                left_out.outside_areas += 1;
            } else {
                views.push((view, table));
            }
        }
        Self { views, left_out }
    }
}
