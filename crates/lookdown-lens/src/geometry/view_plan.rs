//! View plans: which directions a camera is looked at from within.

use std::f64::consts::TAU;

use super::{Lens, Mount, Pixel, VirtualView, virtual_view::ViewDirection};

/// The reading of the paper's field of view (Seidel et al., section III; their formula for the
/// field of view contradicts its own symbols, so three readings exist).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FieldOfViewReading {
    /// 53.13° horizontally and vertically (focal length = view width). The only reading in which
    /// the outermost ring is the last one without black borders, as the paper says of it.
    #[default]
    Horizontal,
    /// 53.13° along the diagonal (38.94° horizontally).
    Diagonal,
    /// The formula taken literally: focal length = half the view width, 90° horizontally.
    Literal,
}

impl FieldOfViewReading {
    /// The full horizontal opening angle, radians.
    pub fn radians(self) -> f64 {
        let focal_per_width = match self {
            Self::Horizontal => 1.0,
            Self::Diagonal => std::f64::consts::SQRT_2,
            Self::Literal => 0.5,
        };
        2.0 * f64::atan(0.5 / focal_per_width)
    }
}

/// A ring of views at one elevation, spread evenly over the full turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ring {
    /// Angle from the plan's axis, radians.
    pub elevation: f64,
    /// The number of views.
    pub count: u32,
    /// Full horizontal opening angle of each, radians.
    pub field_of_view: f64,
}

impl Ring {
    fn from_degrees(elevation: f64, count: u32, field_of_view_deg: f64) -> Self {
        Self {
            elevation,
            count,
            field_of_view: field_of_view_deg.to_radians(),
        }
    }
}

/// The paper's first azimuth is minus this: two decimals, not a half turn.
#[expect(clippy::approx_constant, reason = "the paper's number")]
const PAPER_FIRST_AZIMUTH: f64 = 3.14;

/// The directions a camera is looked at from within.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewPlan {
    /// The directions, in plan order: detail views last.
    pub directions: Vec<ViewDirection>,
    /// The number of directions, from the first on, in which every frame is looked at.
    pub constant_count: usize,
}

impl ViewPlan {
    /// The 128 views of the paper: elevations 0, 0.3, 0.6, 0.9 rad, each at the 32 azimuths
    /// −3.14, −2.94 … 3.06 rad (Seidel et al., section IV).
    pub fn paper(reading: FieldOfViewReading) -> Self {
        let elevations = [0.0, 0.3, 0.6, 0.9];
        let directions = elevations.iter().flat_map(|&elevation| {
            (0..32).map(move |step| ViewDirection {
                elevation,
                azimuth: 0.2 * f64::from(step) - PAPER_FIRST_AZIMUTH,
                field_of_view: reading.radians(),
            })
        });
        Self::constant(directions.collect())
    }

    /// A plan without detail views.
    fn constant(directions: Vec<ViewDirection>) -> Self {
        Self {
            constant_count: directions.len(),
            directions,
        }
    }

    /// Evenly filled rings.
    pub fn rings(rings: &[Ring]) -> Self {
        let directions = rings.iter().flat_map(|ring| {
            (0..ring.count).map(|index| ViewDirection {
                elevation: ring.elevation,
                azimuth: TAU * f64::from(index) / f64::from(ring.count),
                field_of_view: ring.field_of_view,
            })
        });
        Self::constant(directions.collect())
    }

    /// Adds rings of detail views: narrow ones, for those parts of a frame in which the others show
    /// a possible person.
    fn with_details(mut self, rings: &[Ring]) -> Self {
        self.directions.extend(Self::rings(rings).directions);
        self
    }

    /// Five wide views: one more than the least that sees everything from close to the nadir to the
    /// rim.
    pub fn fast() -> Self {
        Self::rings(&[Ring::from_degrees(0.9, 5, 90.0)])
    }

    /// Eight wide views from the nadir to the rim, and eight narrow detail views at the rim, where
    /// people are small.
    pub fn balanced() -> Self {
        let wide = Self::rings(&[Ring::from_degrees(0.8, 8, 90.0)]);
        wide.with_details(&[Ring::from_degrees(1.25, 8, 45.0)])
    }

    /// The same plan with each azimuth larger by `angle`, radians.
    pub fn turned(mut self, angle: f64) -> Self {
        for direction in &mut self.directions {
            direction.azimuth += angle;
        }
        self
    }

    /// The plan's views for a mount, `width` × `height` pixels each, in plan order.
    pub fn views(&self, mount: &Mount, width: u32, height: u32) -> Vec<VirtualView> {
        self.directions
            .iter()
            .map(|direction| VirtualView::new(direction, mount, width, height))
            .collect()
    }
}

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
mod tests;
