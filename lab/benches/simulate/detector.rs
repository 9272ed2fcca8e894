//! A ceiling camera whose detector misses, invents and misplaces persons as the measured one does.
//!
//! The figures of the detector are in `figures`; docs/lab/count-accuracy.md has the assumptions.

use lookdown_lens::geometry::{
    Lens, Mount, OrientedBox, Pixel, PostureSigns, Ray,
    floor::{FloorPosition, bearing, floor_position, pixel_of},
    oriented_box::vertical_in_frame,
};
use lookdown_tracking::{CameraPose, Observation};
use nalgebra::{Point2, Unit, Vector2, Vector3};
use std::collections::HashMap;

use crate::{
    chance::{Chance, Slow},
    figures::{Figures, SCORE_FLOOR},
    people::Body,
};

/// Side of the frame, pixels.
pub const FRAME_PX: f64 = 1280.0;
/// Radius of a person, meters.
const BODY_RADIUS_M: f64 = 0.25;
/// Time over which scores and places stay wrong, seconds, and the share of the variance that does.
const CORRELATION_S: f64 = 1.0;
const SLOW_SHARE: f64 = 0.5;
/// Share of the background's false alarms that come from fixed places (posters, coat stands).
const FIXED_SHARE: f64 = 0.85;
/// Share of the variance of their scores between such places; the rest changes over time.
const FIXED_BETWEEN: f64 = 0.75;
/// Time over which the score of such a place stays the same, seconds.
const FIXED_CORRELATION_S: f64 = 3.0;
/// Loss of the logit of a person who is half hidden behind another one.
const HIDDEN_LOGIT: f64 = 2.0;

/// A camera with its detector.
pub struct Camera {
    pub pose: CameraPose,
    lens: Lens,
    mount: Mount,
    figures: Figures,
    chance: Chance,
    errors: HashMap<u64, Errors>,
    fixed: Vec<FixedPlace>,
}

/// A thing that is taken for a person.
struct FixedPlace {
    place: Vector2<f64>,
    /// Standard normal numbers: the part of the score that stays, and the part that changes.
    lasting: f64,
    changing: Slow,
}

/// The slow errors of one person.
#[derive(Clone, Copy, Default)]
struct Errors {
    score: Slow,
    edges: [Slow; 4],
}

/// A box of the detector.
#[derive(Clone, Copy)]
pub struct Found {
    pub oriented: OrientedBox,
    /// The logit of its score; minus infinity if it is missed.
    pub logit: f64,
}

/// A box that the lens shows.
#[derive(Clone, Copy)]
pub struct Shown {
    pub id: u64,
    pub oriented: OrientedBox,
}

impl Camera {
    pub fn new(
        pose: CameraPose,
        figures: &Figures,
        mut chance: Chance,
        reach_m: Vector2<f64>,
    ) -> Self {
        let center = (FRAME_PX - 1.0) / 2.0;
        let lens = Lens::equidistant_circle(center, center, FRAME_PX / 2.0, 90_f64.to_radians());
        let places = chance.count(figures.background.count * FIXED_SHARE);
        let fixed = (0..places).map(|_| FixedPlace {
            place: Vector2::new(
                chance.uniform(-reach_m.x, reach_m.x),
                chance.uniform(-reach_m.y, reach_m.y),
            ),
            lasting: chance.normal(),
            changing: Slow::default(),
        });
        let fixed = fixed.collect();
        Self {
            pose,
            lens: lens.expect("a valid lens"),
            mount: Mount::new(Unit::new_normalize(-Vector3::z()), pose.height_m),
            figures: *figures,
            fixed,
            errors: HashMap::new(),
            chance,
        }
    }

    /// The camera's floor coordinates of a place of the site.
    pub fn floor_of_site(&self, place: Vector2<f64>) -> Vector2<f64> {
        let away = place - Vector2::from(self.pose.position_m);
        let (sin, cos) = self.pose.yaw_deg.to_radians().sin_cos();
        Vector2::new(cos * away.x + sin * away.y, cos * away.y - sin * away.x)
    }

    /// The oriented box around the visible part of a person.
    pub fn show(&self, id: u64, place: Vector2<f64>, body: Body) -> Option<Shown> {
        let camera_m = self.pose.height_m?;
        let pixel = |x: f64, y: f64, z: f64| {
            let shown = self.lens.project(&Ray::new(x, y, camera_m - z))?;
            Some(Pixel::new(shown.x + 0.5, shown.y + 0.5))
        };
        let middle = pixel(place.x, place.y, f64::midpoint(body.hidden_m, body.top_m))?;
        let up = vertical_in_frame(middle, &self.lens, &self.mount);
        let across = Vector2::new(-up.y, up.x);
        // A round body with narrower feet and head.
        let rings = [(0.0, 0.5), (0.4, 0.8), (0.8, 1.0), (0.95, 0.6), (1.0, 0.3)];
        let (mut low, mut high) = (Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN));
        for (share, radius) in rings {
            let share = f64::max(share, body.hidden_m / body.top_m);
            let center = place + body.lean_m * share;
            for step in 0..12 {
                let (sin, cos) = (f64::from(step) * std::f64::consts::TAU / 12.0).sin_cos();
                let radius = radius * BODY_RADIUS_M;
                let point = pixel(
                    center.x + radius * cos,
                    center.y + radius * sin,
                    share * body.top_m,
                )?;
                let along = Vector2::new((point - middle).dot(&across), (point - middle).dot(&up));
                low = low.inf(&along);
                high = high.sup(&along);
            }
        }
        let oriented = with_edges(middle, up, low, high);
        Some(Shown { id, oriented })
    }

    /// The persons that the detector reports at `at_s`.
    pub fn detect(&mut self, at_s: f64, shown: &[Shown]) -> Vec<(Observation, OrientedBox)> {
        let found = self.search(at_s, shown);
        self.observed(&found)
    }

    /// The boxes from the score floor on.
    pub fn observed(&self, found: &[Found]) -> Vec<(Observation, OrientedBox)> {
        let observed = found.iter().filter_map(|found| self.observe(*found));
        observed.collect()
    }

    /// The boxes in the whole frame.
    pub fn search(&mut self, at_s: f64, shown: &[Shown]) -> Vec<Found> {
        let mut found = self.boxes_of(at_s, shown, |_| true);
        self.invent_at_fixed_places(at_s, |_| true, &mut found);
        self.invent_anywhere(&mut found);
        found
    }

    /// The boxes of the persons and fixed places that crops show.
    pub fn search_crops(
        &mut self,
        at_s: f64,
        shown: &[Shown],
        is_in_crop: impl Fn(&OrientedBox) -> bool,
    ) -> Vec<Found> {
        let mut found = self.boxes_of(at_s, shown, &is_in_crop);
        self.invent_at_fixed_places(at_s, is_in_crop, &mut found);
        found
    }

    fn boxes_of(
        &mut self,
        at_s: f64,
        shown: &[Shown],
        is_searched: impl Fn(&OrientedBox) -> bool,
    ) -> Vec<Found> {
        let mut found = Vec::new();
        for person in shown.iter().filter(|person| is_searched(&person.oriented)) {
            let hidden = self.is_hidden(person, shown);
            let mut errors = self.errors.get(&person.id).copied().unwrap_or_default();
            let slow = self.mixed(&mut errors.score, at_s);
            let lost = if hidden { HIDDEN_LOGIT } else { 0.0 };
            let logit = self.logit_of(&person.oriented, slow) - lost;
            let mut edges = [0.0; 4];
            for (edge, slow) in edges.iter_mut().zip(&mut errors.edges) {
                *edge = self.figures.edge * self.mixed(slow, at_s);
            }
            self.errors.insert(person.id, errors);
            found.push(Found {
                oriented: moved(&person.oriented, edges),
                logit,
            });
            let Figures { parts, .. } = self.figures;
            for _ in 0..self.chance.count(parts.count) {
                let shift = self.chance.uniform(-0.4, 0.4);
                found.push(Found {
                    oriented: moved(&person.oriented, [shift, shift, shift * 0.3, shift * 0.3]),
                    logit: parts.logit_of(self.chance.normal()),
                });
            }
        }
        found
    }

    fn invent_at_fixed_places(
        &mut self,
        at_s: f64,
        is_searched: impl Fn(&OrientedBox) -> bool,
        found: &mut Vec<Found>,
    ) {
        let Figures { background, .. } = self.figures;
        for index in 0..self.fixed.len() {
            let fixed = &mut self.fixed[index];
            let changing = fixed
                .changing
                .at(at_s, FIXED_CORRELATION_S, &mut self.chance);
            let value =
                FIXED_BETWEEN.sqrt() * fixed.lasting + (1.0 - FIXED_BETWEEN).sqrt() * changing;
            let place = fixed.place;
            let shown = self.show(0, place, Body::standing(1.7));
            let shown = shown.filter(|shown| is_searched(&shown.oriented));
            found.extend(shown.map(|shown| Found {
                oriented: shown.oriented,
                logit: background.logit_of(value),
            }));
        }
    }

    fn invent_anywhere(&mut self, found: &mut Vec<Found>) {
        let Figures { background, .. } = self.figures;
        for _ in 0..self.chance.count(background.count * (1.0 - FIXED_SHARE)) {
            let reach = 6.0;
            let place = Vector2::new(
                self.chance.uniform(-reach, reach),
                self.chance.uniform(-reach, reach),
            );
            if let Some(Shown { oriented, .. }) = self.show(0, place, Body::standing(1.7)) {
                let logit = background.logit_of(self.chance.normal());
                found.push(Found { oriented, logit });
            }
        }
    }

    fn mixed(&mut self, slow: &mut Slow, at_s: f64) -> f64 {
        let slow = slow.at(at_s, CORRELATION_S, &mut self.chance);
        SLOW_SHARE.sqrt() * slow + (1.0 - SLOW_SHARE).sqrt() * self.chance.normal()
    }

    /// The logit of the score of a person, for a standard normal number.
    fn logit_of(&self, oriented: &OrientedBox, normal: f64) -> f64 {
        let angle = bearing(oriented.center, &self.lens).map_or(90.0, |b| b.off_axis.to_degrees());
        self.figures.logit_of_person(angle, normal)
    }

    fn is_hidden(&self, person: &Shown, shown: &[Shown]) -> bool {
        let center = self.lens.principal_point();
        let polar = |shown: &Shown| {
            let away = shown.oriented.center - center;
            (away.norm(), away.y.atan2(away.x))
        };
        let (radius, azimuth) = polar(person);
        shown.iter().any(|other| {
            let (other_radius, other_azimuth) = polar(other);
            let turn = (azimuth - other_azimuth + std::f64::consts::PI)
                .rem_euclid(std::f64::consts::TAU)
                - std::f64::consts::PI;
            let gap = turn.abs() * radius;
            other.id != person.id
                && other_radius < radius
                && radius - other_radius < 0.7 * person.oriented.height
                && gap < 0.5 * person.oriented.width
        })
    }

    fn observe(&self, found: Found) -> Option<(Observation, OrientedBox)> {
        let Found { oriented, logit } = found;
        let score = 1.0 / (1.0 + (-logit).exp());
        let seen = bearing(oriented.center, &self.lens)?;
        let foot = oriented.foot();
        let floor = floor_position(foot, &self.lens, &self.mount);
        (score >= SCORE_FLOOR).then(|| {
            let observation = Observation {
                floor_m: floor.map(|place| [place.x_m, place.y_m]),
                azimuth_deg: (seen.azimuth.to_degrees() + 90.0).rem_euclid(360.0),
                off_axis_deg: seen.off_axis.to_degrees(),
                center_px: [oriented.center.x, oriented.center.y],
                size_px: [oriented.width, oriented.height],
                signs: PostureSigns::default(),
                foot_px: [foot.x, foot.y],
                score,
                is_in_margin: false,
            };
            (observation, oriented)
        })
    }

    /// The pixel of a floor place of this camera.
    pub fn pixel_of_floor(&self, place: Vector2<f64>) -> Option<Pixel> {
        let place = FloorPosition {
            x_m: place.x,
            y_m: place.y,
        };
        pixel_of(place, &self.lens, &self.mount)
    }
}

/// The box with edges moved by shares of its extents: lower, upper, left, right.
fn moved(oriented: &OrientedBox, [lower, upper, left, right]: [f64; 4]) -> OrientedBox {
    let half = Vector2::new(oriented.width, oriented.height) / 2.0;
    let low = Vector2::new(
        -half.x + left * oriented.width,
        -half.y + lower * oriented.height,
    );
    let high = Vector2::new(
        half.x + right * oriented.width,
        half.y + upper * oriented.height,
    );
    with_edges(oriented.center, oriented.up, low, high)
}

fn with_edges(
    center: Pixel,
    up: Vector2<f64>,
    low: Vector2<f64>,
    high: Vector2<f64>,
) -> OrientedBox {
    let across = Vector2::new(-up.y, up.x);
    let middle = (low + high) / 2.0;
    let place: Point2<f64> = center + across * middle.x + up * middle.y;
    let mut oriented = OrientedBox::turned(place, high.x - low.x, high.y - low.y, 0.0);
    oriented.up = up;
    oriented
}

/// Bounds of the ellipse in an oriented box: x and y of the least corner, x and y of the greatest.
pub fn bounds(oriented: &OrientedBox) -> [f64; 4] {
    let up = oriented.up * (oriented.height / 2.0);
    let across = Vector2::new(-oriented.up.y, oriented.up.x) * (oriented.width / 2.0);
    let half = Vector2::new(up.x.hypot(across.x), up.y.hypot(across.y));
    let center = oriented.center;
    [
        center.x - half.x,
        center.y - half.y,
        center.x + half.x,
        center.y + half.y,
    ]
}
