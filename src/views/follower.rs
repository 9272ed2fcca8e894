//! The axis of the views that follow a person: smooth, and on the newest arrival.

use std::f64::consts::PI;

use lookdown_calibration::CameraGeometry;
use lookdown_lens::geometry::{
    OrientedBox, Pixel, Ray,
    pixels::{PixelConvention, cross_half_pixel},
};

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
/// Reports with a person before it is followed: false detections are mostly single.
const LEAST_SIGHTS: u32 = 2;
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
    /// Angle from the center to the farthest corner of the box, radians.
    extent: f64,
    sights: u32,
    misses: u32,
}

impl Follower {
    /// Notes the persons of a report.
    pub(super) fn update(&mut self, persons: &[OrientedBox], camera: &CameraGeometry) {
        let found = persons.iter().take(MAX_PERSONS);
        let mut found: Vec<_> = found.filter_map(|person| seen(person, camera)).collect();
        for known in &mut self.persons {
            let angle = |other: &Seen| known.ray.angle(&other.ray);
            let nearest = found.iter().enumerate();
            let nearest =
                nearest.min_by(|(_, one), (_, other)| angle(one).total_cmp(&angle(other)));
            match nearest {
                Some((index, other)) if angle(other) <= GATE => {
                    let other = found.swap_remove(index);
                    *known = Seen {
                        sights: known.sights + 1,
                        ..other
                    };
                }
                _ => known.misses += 1,
            }
        }
        self.persons.retain(|known| known.misses <= MAX_MISSES);
        let free = MAX_PERSONS.saturating_sub(self.persons.len());
        self.persons.extend(found.into_iter().take(free));
    }

    /// Turns the axis toward the person for the next frame, and returns it. `None` before the first
    /// person.
    pub(super) fn advance(&mut self) -> Option<Direction> {
        let followed = self.persons.iter();
        let mut followed = followed.filter(|person| person.sights >= LEAST_SIGHTS);
        let Some(person) = followed.next_back() else {
            return self.direction();
        };
        let wanted = tilted(person.ray);
        let field_of_view = (2.0 * ROOM * person.extent).clamp(FIELDS[0], FIELDS[1]);
        let (axis, field) = self.axis.get_or_insert((wanted, field_of_view));
        let angle = axis.angle(&wanted);
        let part = APPROACH.min(MAX_TURN / angle.max(f64::EPSILON));
        if angle > f64::EPSILON {
            let turned = *axis * ((1.0 - part) * angle).sin() + wanted * (part * angle).sin();
            *axis = turned.normalize();
        }
        *field += ZOOM * (field_of_view - *field);
        // A person that is faster than the axis stays in a wider view.
        let needed = REACH * (axis.angle(&person.ray) + person.extent);
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
        let pixel = cross_half_pixel(point, PixelConvention::PixelCenter);
        let ray = camera.lens.unproject(&pixel)?.normalize();
        Some(from_camera.inverse_transform_vector(&ray))
    };
    let ray = ray_at(person.center)?;
    let corners = person.corners();
    let corners = corners.iter().filter_map(|corner| ray_at(*corner));
    Some(Seen {
        extent: corners.map(|corner| corner.angle(&ray)).fold(0.0, f64::max),
        ray,
        sights: 1,
        misses: 0,
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use lookdown_calibration::Areas;
    use lookdown_lens::geometry::{Lens, Mount};

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
        assert!(frames > 28 && seen == frames, "{seen} of {frames}");
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
        assert!(is_near(after(&[new, old], 80), PI));
        // A miss does not move the view, and a person who has left does.
        assert!(is_near(after(&[old], 5), PI));
        assert!(is_near(after(&[old], 90), 0.0));
        assert!(is_near(after(&[], 40), 0.0));
    }
}
