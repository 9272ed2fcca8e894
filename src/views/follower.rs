//! The axis of the views that follow a person: smooth, and on the newest arrival. A person has
//! arrived once it has moved: furniture and false detections do not.

use std::f64::consts::PI;

use lookdown_calibration::CameraGeometry;
use lookdown_lens::geometry::{OrientedBox, Pixel, Ray, pixels::to_pixel_center};

use super::view::Direction;

/// Most persons that are told apart.
const MAX_PERSONS: usize = 64;
/// Largest turn of the axis between two frames, radians.
const MAX_TURN: f64 = 3.0 * PI / 180.0;
/// Part of the way to the person in one frame: boxes jitter by a few degrees.
const APPROACH: f64 = 0.4;
/// Part of the way to the wanted width in one frame.
const ZOOM: f64 = 0.1;
/// Angle between two sights of a person, radians: 1.5 m/s at 1.8 m and 2 reports a second.
const GATE: f64 = 25.0 * PI / 180.0;
/// Reports without a person after which it has left. Detectors miss persons for a moment.
const MAX_MISSES: u32 = 10;
/// Reports of a person at another place than its first one before it is followed.
const LEAST_MOVES: u32 = 2;
/// Angle between two places of a person, radians: boxes of people who stand move less.
const MOVE: f64 = 10.0 * PI / 180.0;
/// Reports with a person who has not moved before it is followed: it may sit.
const LEAST_SIGHTS: u32 = 20;
/// Range of the tilt, radians. Nearer to the nadir the view would spin about its axis.
const TILTS: [f64; 2] = [25.0 * PI / 180.0, 80.0 * PI / 180.0];
/// Range of the field of view, radians.
const FIELDS: [f64; 2] = [40.0 * PI / 180.0, 130.0 * PI / 180.0];
/// Field of view that holds a person, in angles from the axis to the farthest part of it: the view
/// is lower than wide.
const REACH: f64 = 2.4;
/// Height of a view, in heights of the person in it.
const ROOM: f64 = 2.0;

/// The persons of a camera, and the axis of its following views.
#[derive(Debug, Default)]
pub(super) struct Follower {
    /// In the order of their arrival.
    persons: Vec<Seen>,
    /// The axis, of unit length in the leveled camera frame, and the field of view, radians.
    axis: Option<(Ray, f64)>,
}

#[derive(Debug)]
struct Seen {
    /// Unit length, in the leveled camera frame.
    ray: Ray,
    /// Its first ray.
    first: Ray,
    /// Angle from the center to the farthest corner of the box, radians.
    extent: f64,
    sights: u32,
    /// The number of sights at another place than the first one.
    moves: u32,
    misses: u32,
}

impl Follower {
    /// Notes the persons of a report.
    pub(super) fn update(&mut self, persons: &[OrientedBox], camera: &CameraGeometry) {
        let found = persons.iter().take(MAX_PERSONS);
        let mut found: Vec<_> = found.map(|person| seen(person, camera)).collect();
        let mut pairs = Vec::new();
        for (index, known) in self.persons.iter_mut().enumerate() {
            known.misses += 1;
            for (other, seen) in found.iter().enumerate() {
                let angle = seen.as_ref().map(|seen| known.ray.angle(&seen.ray));
                pairs.extend(angle.map(|angle| (angle, index, other)));
            }
        }
        pairs.retain(|(angle, ..)| *angle <= GATE);
        pairs.sort_by(|(one, ..), (other, ..)| one.total_cmp(other));
        for (_, index, other) in pairs {
            let known = &mut self.persons[index];
            if known.misses == 0 {
                continue;
            }
            if let Some(seen) = found[other].take() {
                let has_moved = known.first.angle(&seen.ray) > MOVE;
                *known = Seen {
                    first: known.first,
                    sights: known.sights + 1,
                    moves: known.moves + u32::from(has_moved),
                    ..seen
                };
            }
        }
        self.persons.retain(|known| known.misses <= MAX_MISSES);
        let free = MAX_PERSONS.saturating_sub(self.persons.len());
        self.persons.extend(found.into_iter().flatten().take(free));
    }

    /// The newest person who has moved, or else the one who has been there longest.
    fn followed(&self) -> Option<&Seen> {
        let mut persons = self.persons.iter();
        let arrived = persons.clone().rfind(|person| person.moves >= LEAST_MOVES);
        arrived.or_else(|| persons.find(|person| person.sights >= LEAST_SIGHTS))
    }

    /// Turns the axis toward the person for the next frame, and returns it. `None` before the first
    /// person.
    pub(super) fn advance(&mut self) -> Option<Direction> {
        let Some(person) = self.followed() else {
            return self.direction();
        };
        let (ray, extent) = (person.ray, person.extent);
        let wanted = tilted(ray);
        let field_of_view = (2.0 * ROOM * extent).clamp(FIELDS[0], FIELDS[1]);
        let (axis, field) = self.axis.get_or_insert((wanted, field_of_view));
        let angle = axis.angle(&wanted);
        let part = APPROACH.min(MAX_TURN / angle.max(f64::EPSILON));
        if angle > f64::EPSILON {
            let turned = *axis * ((1.0 - part) * angle).sin() + wanted * (part * angle).sin();
            *axis = turned.normalize();
        }
        *field += ZOOM * (field_of_view - *field);
        // A person that is faster than the axis stays in a wider view.
        let needed = REACH * (axis.angle(&ray) + extent);
        *field = field.max(needed.min(FIELDS[1]));
        self.direction()
    }

    fn direction(&self) -> Option<Direction> {
        let (axis, field_of_view) = self.axis?;
        Some(Direction {
            azimuth: axis.y.atan2(axis.x),
            tilt: axis.x.hypot(axis.y).atan2(axis.z),
            field_of_view,
        })
    }
}

/// Returns the ray within the range of the tilt.
fn tilted(ray: Ray) -> Ray {
    let across = ray.x.hypot(ray.y);
    let (sin, cos) = across.atan2(ray.z).clamp(TILTS[0], TILTS[1]).sin_cos();
    let scale = sin / across.max(f64::EPSILON);
    Ray::new(ray.x * scale, ray.y * scale, cos).normalize()
}

fn seen(person: &OrientedBox, camera: &CameraGeometry) -> Option<Seen> {
    let from_camera = camera.mount.camera_from_floor();
    let ray_at = |point: Pixel| {
        let pixel = to_pixel_center(point);
        let ray = camera.lens.unproject(&pixel)?.normalize();
        Some(from_camera.inverse_transform_vector(&ray))
    };
    let ray = ray_at(person.center)?;
    let corners = person.corners();
    let corners = corners.iter().filter_map(|corner| ray_at(*corner));
    Some(Seen {
        extent: corners.map(|corner| corner.angle(&ray)).fold(0.0, f64::max),
        ray,
        first: ray,
        sights: 1,
        moves: 0,
        misses: 0,
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use lookdown_calibration::Areas;
    use lookdown_lens::geometry::{Lens, Mount, pixels::to_corner_origin};

    use super::*;
    use crate::views::view::{View, ViewKind, box_in_view};

    fn camera() -> CameraGeometry {
        CameraGeometry {
            lens: Lens::equidistant_circle(839.5, 839.5, 840.0, FRAC_PI_2).unwrap(),
            mount: Mount::default(),
            areas: Areas::default(),
        }
    }

    /// The box of a person (1.7 m by 0.5 m) at a place of the floor, 2.8 m below the camera.
    fn person(x: f64, y: f64) -> OrientedBox {
        let camera = camera();
        let pixel = |height: f64| {
            camera
                .lens
                .project(&Ray::new(x, y, 2.8 - height).normalize())
        };
        let (foot, head) = (pixel(0.0).unwrap(), pixel(1.7).unwrap());
        let along = head - foot;
        let center = foot + along / 2.0;
        let angle = along.x.atan2(-along.y);
        OrientedBox::turned(center, 0.3 * along.norm(), along.norm(), angle)
    }

    /// The ray of an axis.
    fn ray(axis: &Direction) -> Ray {
        let (sin, cos) = axis.azimuth.sin_cos();
        Ray::new(
            axis.tilt.sin() * cos,
            axis.tilt.sin() * sin,
            axis.tilt.cos(),
        )
    }

    /// A frame of the rendered walks.
    #[derive(serde::Deserialize)]
    struct WalksFrame {
        /// Center, width, height and angle of the detected persons.
        boxes: Vec<[f64; 5]>,
        /// The true places on the floor, meters.
        walkers: Vec<[f64; 2]>,
    }

    #[test]
    fn each_walker_of_the_rendered_walks_stays_in_view() {
        let frames = include_str!("../../tests/fixtures/followed_walks.json");
        let frames: Vec<WalksFrame> = serde_json::from_str(frames).unwrap();
        let camera = CameraGeometry {
            lens: Lens::equidistant_circle(479.5, 479.5, 480.0, FRAC_PI_2).unwrap(),
            ..camera()
        };
        let view = View {
            kind: ViewKind::Follow,
            ..View::default()
        };
        // The middle of a body, in frame pixels.
        let pixel = |[x, y]: [f64; 2]| {
            let middle = Ray::new(x, y, 3.07 - 0.95).normalize();
            let pixel = camera.lens.project(&middle).unwrap();
            to_corner_origin(pixel)
        };
        for walker in 0..5 {
            let (mut follower, mut seen, mut shown) = (Follower::default(), 0, 0);
            let mut last: Option<Direction> = None;
            for frame in &frames {
                let walkers = frame.walkers.iter().map(|at| pixel(*at));
                let walkers: Vec<_> = walkers.collect();
                // The room has this walker alone, with the person who stands and false detections.
                let boxes = frame.boxes.iter().filter(|[x, y, ..]| {
                    let distance = |at: &Pixel| (Pixel::new(*x, *y) - at).norm();
                    let nearest = walkers.iter().enumerate();
                    let nearest = nearest.map(|(index, at)| (distance(at), index));
                    let nearest = nearest.min_by(|one, other| one.0.total_cmp(&other.0));
                    nearest.is_none_or(|(distance, index)| index == walker || distance > 80.0)
                });
                let boxes = boxes.map(|&[x, y, width, height, angle]| {
                    OrientedBox::turned(Pixel::new(x, y), width, height, angle.to_radians())
                });
                follower.update(&boxes.collect::<Vec<_>>(), &camera);
                let Some(axis) = follower.advance() else {
                    continue;
                };
                if let Some(last) = last.replace(axis) {
                    let turned = ray(&axis).angle(&ray(&last));
                    assert!(turned <= MAX_TURN * 1.001, "{}°", turned.to_degrees());
                }
                let parts = view.parts(&axis, &camera).unwrap();
                seen += 1;
                shown += usize::from(parts[0].shown(walkers[walker], &camera).is_some());
            }
            println!("walker {walker}: in {shown} of {seen} frames of the view");
            assert!(seen > 160 && 100 * shown >= 99 * seen, "{shown} of {seen}");
        }
    }

    #[test]
    fn a_walker_stays_in_view_and_the_axis_turns_by_3_degrees() {
        let (camera, mut follower) = (camera(), Follower::default());
        let view = View {
            kind: ViewKind::Follow,
            ..View::default()
        };
        let (mut frames, mut seen, mut last) = (0, 0, None);
        // Walks past the camera at 1.3 m/s and a distance of 1.2 m, with 5 reports a second.
        for step in 0..32 {
            let x = -4.0 + 0.26 * f64::from(step);
            let walker = person(x, 1.2);
            follower.update(&[walker], &camera);
            let Some(axis) = follower.advance() else {
                continue;
            };
            if let Some(last) = last.replace(axis) {
                let turned = ray(&axis).angle(&ray(&last));
                assert!(turned <= MAX_TURN * 1.001, "{}°", turned.to_degrees());
            }
            frames += 1;
            let parts = view.parts(&axis, &camera).unwrap();
            seen += usize::from(box_in_view(&parts, &walker, &camera).is_some());
        }
        assert!(frames > 20 && seen == frames, "{seen} of {frames}");
    }

    #[test]
    fn a_person_at_the_ends_of_a_panorama_has_a_narrow_box() {
        let view = View {
            kind: ViewKind::Panorama,
            width: 1000,
            height: 300,
            ..View::default()
        };
        let parts = view.parts(&view.direction(), &camera()).unwrap();
        for y in [-0.1, 0.1] {
            let [left, _, right, _] = box_in_view(&parts, &person(-2.0, y), &camera()).unwrap();
            assert!((10.0..100.0).contains(&(right - left)), "{left} to {right}");
            assert!(left == 0.0 || right == 1000.0, "{left} to {right}");
        }
    }

    #[test]
    fn the_newest_arrival_is_followed_until_it_leaves() {
        let (camera, mut follower) = (camera(), Follower::default());
        let (old, new) = (person(2.0, 0.0), person(-2.0, 0.0));
        let mut after = |persons: &[OrientedBox], count: u32| {
            for _ in 0..count {
                follower.update(persons, &camera);
                follower.advance();
            }
            follower.advance().unwrap().azimuth
        };
        let is_near = |azimuth: f64, wanted: f64| ((azimuth - wanted).cos() - 1.0).abs() < 1e-3;
        assert!(is_near(after(&[old], 40), 0.0));
        // Who has not moved may be furniture.
        assert!(is_near(after(&[person(-2.0, 2.0), old], 80), 0.0));
        assert!(is_near(after(&[person(-2.0, 1.0), old], 1), 0.0));
        assert!(is_near(after(&[new, old], 80), PI));
        // A miss does not move the view, and a person who has left does.
        assert!(is_near(after(&[old], 5), PI));
        assert!(is_near(after(&[old], 90), 0.0));
        assert!(is_near(after(&[], 40), 0.0));
    }
}
