//! Errors of interpolated positions against the exact lens model.

use lookdown_lens::geometry::{FieldOfViewReading, Mount, ViewPlan};

use super::{
    super::*,
    lenses::{FRAME_SIDE, every_lens},
    three_rings,
};

/// Distances between two places, in pixels of the frame and in pixels of the view.
#[derive(Debug, Default)]
struct Distances {
    greatest: [f64; 2],
    sums: [f64; 2],
    counts: [f64; 2],
}

impl Distances {
    fn add(&mut self, space: usize, distance: f64) {
        self.greatest[space] = self.greatest[space].max(distance);
        self.sums[space] += distance;
        self.counts[space] += 1.0;
    }

    /// At every third pixel of one view of each ring.
    fn new(lens: &Lens, plan: &ViewPlan, side: u32) -> Self {
        let views = plan.views(&Mount::default(), side, side);
        let tables = RemapTable::for_views(&views, lens, FRAME_SIDE, FRAME_SIDE);
        let mut distances = Self::default();
        let mut grids = HashSet::new();
        for (view, table) in views.iter().zip(&tables) {
            if !grids.insert(Arc::as_ptr(&table.grid)) {
                continue;
            }
            let rows = (0..side).step_by(3);
            for (x, y) in rows.flat_map(|y| (0..side).step_by(3).map(move |x| (x, y))) {
                distances.add_pixel(view, table, lens, (x, y));
            }
        }
        distances
    }

    fn add_pixel(&mut self, view: &VirtualView, table: &RemapTable, lens: &Lens, at: (u32, u32)) {
        let pixel = Pixel::new(f64::from(at.0), f64::from(at.1));
        let exact = lens.project(&view.ray_in_camera(&pixel));
        let found = table.position(at.0, at.1);
        assert_eq!(exact.is_some(), found.is_some(), "{} {at:?}", lens.model());
        let (Some(exact), Some(found)) = (exact, found) else {
            return;
        };
        self.add(0, (found - exact).norm());
        // What is found for the outermost pixels may lie a little beyond the rim.
        let seen = lens.unproject(&found).and_then(|ray| view.project(&ray));
        if let Some(seen) = seen {
            self.add(1, (seen - pixel).norm());
        }
    }

    fn assert_below(&self, greatest: [f64; 2], means: [f64; 2], of: &str) {
        for space in 0..2 {
            let mean = self.sums[space] / self.counts[space];
            assert!(self.greatest[space] < greatest[space], "{of}: {self:?}");
            assert!(mean < means[space], "{of}: {mean}, {self:?}");
        }
    }
}

#[test]
fn tables_are_as_exact_as_they_say_for_every_lens_model() {
    for lens in every_lens() {
        let in_three_rings = Distances::new(&lens, &three_rings(), 416);
        let wide = ViewPlan::paper(FieldOfViewReading::Literal);
        let in_widest_plan = Distances::new(&lens, &wide, 300);
        let (of_rings, of_widest) = match lens.model() {
            // Stretches what is far from its axis …
            "rectilinear" => ([1.2, 0.14], [2.6, 0.22]),
            // … or squeezes it.
            "orthographic" => ([0.3, 0.8], [0.6, 1.1]),
            _ => ([0.18, 0.13], [0.35, 0.18]),
        };
        in_three_rings.assert_below(of_rings, [0.07, 0.07], lens.model());
        in_widest_plan.assert_below(of_widest, [0.2, 0.1], lens.model());
    }
}
