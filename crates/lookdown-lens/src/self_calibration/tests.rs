//! Fits of cameras to drawn edges of a room.

mod followed_edges;
mod known;
mod vertical;

use nalgebra::{Rotation3, Vector3};

use super::{
    CircleGuess, EdgeCurve, FieldOfView, FitRefusal, IdealLens, KnownCamera, RoomFit,
    camera::{Angles, RoomCamera},
    evidence::evaluate,
    fit::prior,
    maxima::stepped,
    prior::{PARAMETERS, Parameters},
    search::Triples,
};
use crate::geometry::Ray;

const FOCAL: f64 = 400.0;
const CENTER: [f64; 2] = [603.0, 596.0];

/// Pixel of a ray in an equisolid lens.
fn pixel(ray: &Ray) -> [f64; 2] {
    let theta = ray.z.atan2(ray.x.hypot(ray.y));
    let radius = 2.0 * FOCAL * ((std::f64::consts::FRAC_PI_2 - theta) / 2.0).sin();
    let flat = ray.x.hypot(ray.y).max(1e-12);
    [
        CENTER[0] + radius * ray.x / flat,
        CENTER[1] + radius * ray.y / flat,
    ]
}

/// The ray of a pixel in that lens.
fn ray([x, y]: [f64; 2]) -> Ray {
    let [x, y] = [x - CENTER[0], y - CENTER[1]];
    let radius = x.hypot(y);
    let (sin, cos) = (2.0 * (radius / (2.0 * FOCAL)).asin()).sin_cos();
    Ray::new(sin * x / radius, sin * y / radius, cos)
}

/// Edges of a room of 6 by 5 by 2.8 meters seen by a tilted camera below its ceiling.
fn edges(camera_from_room: &Rotation3<f64>) -> Vec<EdgeCurve> {
    let mut edges = Vec::new();
    let mut add = |from: [f64; 3], to: [f64; 3]| {
        let [from, to] = [from, to].map(Vector3::from);
        let points: Vec<[f64; 2]> = (0..12)
            .map(|step| from + (to - from) * (f64::from(step) / 11.0))
            .map(|at| camera_from_room * at)
            .filter(|ray| ray.angle(&Ray::z()) < 1.6)
            .map(|ray| pixel(&ray))
            .collect();
        if points.len() > 2 {
            edges.push(EdgeCurve { points, scale: 1.0 });
        }
    };
    for step in 0..12 {
        let share = f64::from(step) / 11.0;
        let (x, y) = (-2.0 + 6.0 * share, -3.0 + 5.0 * share);
        add([x, -3.0, 0.3], [x, -3.0, 2.0]);
        add([x, 2.0, 0.6], [x, 2.0, 2.7]);
        add([-2.0, y, 0.5], [-2.0, y, 1.9]);
        add([4.0, y, 0.4], [4.0, y, 2.5]);
        add([x, -3.0, 2.7], [x, -1.2, 2.7]);
        add([-2.0, y, 2.7], [0.5, y, 2.7]);
        add(
            [-1.0 + share, -3.0, 0.5 + share],
            [1.0 + share, -3.0, 0.5 + share],
        );
    }
    edges
}

fn circle() -> CircleGuess {
    CircleGuess {
        center: [600.0, 600.0],
        radius: 2.0 * FOCAL * (1.55_f64 / 2.0).sin(),
        center_sigma: 6.0,
    }
}

fn equisolid() -> KnownCamera {
    KnownCamera {
        lens: Some(IdealLens::Equisolid),
        ..KnownCamera::default()
    }
}

/// Asserts that the vertical of a fit is right within so many degrees.
#[track_caller]
fn assert_level(fit: &RoomFit, camera_from_room: &Rotation3<f64>, degrees: f64) {
    let down = camera_from_room * Ray::z();
    let off = fit.directions[0].angle(&down).to_degrees();
    assert!(off < degrees, "{off}° off level");
}

#[test]
fn tilted_equisolid_camera_is_found() {
    let room = Rotation3::from_euler_angles(0.14, -0.09, 0.4);
    let fit = RoomFit::new(&[edges(&room)], &[circle()], KnownCamera::default()).unwrap();
    assert_level(&fit, &room, 0.2);
    let off = (fit.center[0] - CENTER[0]).hypot(fit.center[1] - CENTER[1]);
    assert!(off < 2.0, "{off} pixels off center");
    for degrees in [20.0_f64, 50.0, 80.0] {
        let theta = degrees.to_radians();
        let square = theta * theta;
        let odd = fit.k.iter().rev().fold(0.0, |sum, k| (sum + k) * square);
        let ratio = fit.focal * theta * (1.0 + odd) / (2.0 * FOCAL * (theta / 2.0).sin());
        assert!((ratio - 1.0).abs() < 0.01, "{ratio} at {degrees}°");
    }
}

#[test]
fn given_field_of_view_is_kept() {
    let room = Rotation3::from_euler_angles(0.1, 0.05, 0.2);
    let known = KnownCamera {
        field_of_view: Some(FieldOfView::from_degrees(177.6).unwrap()),
        ..equisolid()
    };
    let fit = RoomFit::new(&[edges(&room)], &[circle()], known).unwrap();
    assert!(
        (2.0 * fit.max_theta.to_degrees() - 177.6).abs() < 0.6,
        "{}",
        fit.max_theta
    );
}

#[test]
fn few_edges_are_refused() {
    let room = Rotation3::identity();
    let few = edges(&room).split_off(70);
    let refusal = RoomFit::new(
        std::slice::from_ref(&few),
        &[circle()],
        KnownCamera::default(),
    );
    assert_eq!(refusal, Err(FitRefusal::TooFewEdges { edges: few.len() }));
}

/// Short edges in random directions all over the image.
fn clutter(count: usize) -> Vec<EdgeCurve> {
    let mut state = 7_u64;
    let mut random = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        f64::from(u32::try_from(state >> 40).unwrap()) / f64::from(1 << 24)
    };
    (0..count)
        .map(|_| {
            let ([x, y], turn) = (
                [200.0 + 800.0 * random(), 200.0 + 800.0 * random()],
                std::f64::consts::TAU * random(),
            );
            let points = (0..6).map(|step| 8.0 * f64::from(step));
            EdgeCurve {
                points: points
                    .map(|far| [x + far * turn.cos(), y + far * turn.sin()])
                    .collect(),
                scale: 1.0,
            }
        })
        .collect()
}

#[test]
fn edges_without_order_are_refused() {
    for count in [200, 1500] {
        let fit = RoomFit::new(&[clutter(count)], &[circle()], KnownCamera::default());
        assert!(
            matches!(fit, Err(FitRefusal::NoDirections { .. })),
            "{count} edges: {fit:?}"
        );
    }
}

#[test]
fn room_with_more_clutter_than_walls_is_fitted() {
    let room = Rotation3::from_euler_angles(0.14, -0.09, 0.4);
    let all = [edges(&room), clutter(700)].concat();
    let fit = RoomFit::new(&[all], &[circle()], KnownCamera::default()).unwrap();
    assert!(fit.explained < 0.45, "{}", fit.explained);
    assert_level(&fit, &room, 0.2);
}

#[test]
fn clutter_makes_the_lens_less_certain() {
    let room = Rotation3::from_euler_angles(0.14, -0.09, 0.4);
    let uncertainty = |edges: Vec<EdgeCurve>| {
        let fit = RoomFit::new(&[edges], &[circle()], KnownCamera::default()).unwrap();
        fit.uncertainty.radius
    };
    let clear = uncertainty(edges(&room));
    let cluttered = uncertainty([edges(&room), clutter(700)].concat());
    assert!(cluttered > 1.15 * clear, "{cluttered}, without {clear}");
}

#[test]
fn edges_of_a_coarser_raster_are_less_certain() {
    let room = Rotation3::from_euler_angles(0.14, -0.09, 0.4);
    let fit = |scale: f64| {
        let mut edges = edges(&room);
        for edge in &mut edges {
            edge.scale = scale;
        }
        RoomFit::new(&[edges], &[circle()], KnownCamera::default()).unwrap()
    };
    let [fine, coarse] = [1.0, 4.0].map(|scale| fit(scale).uncertainty.level_deg);
    assert!(coarse > 1.5 * fine, "{coarse}°, in the finest {fine}°");
}

#[test]
fn many_exact_edges_leave_the_uncertainty_of_the_lens() {
    let room = Rotation3::from_euler_angles(0.14, -0.09, 0.4);
    let many = vec![edges(&room); 15].concat();
    let fit = RoomFit::new(&[many], &[circle()], KnownCamera::default()).unwrap();
    assert!(
        (0.003..0.004).contains(&fit.uncertainty.radius),
        "{}",
        fit.uncertainty.radius
    );
}

#[test]
fn stretched_lens_keeps_edges_of_a_level_room_straight() {
    let camera = RoomCamera {
        focal: FOCAL,
        k1: -1.0 / 24.0,
        k2_offset: 0.0,
        center: CENTER,
        room: Rotation3::identity(),
    };
    let other = camera.stretched(1.1).unwrap();
    let angles = Angles::from_camera(&other, 540.0).unwrap();
    assert!(other.focal > 1.03 * FOCAL, "{}", other.focal);
    for y in [-2.0, -0.5, 1.0, 3.0] {
        let line = [-3.0, -1.0, 2.0].map(|x| pixel(&Ray::new(x, y, 1.0)));
        let [one, middle, last] = line.map(|at| angles.ray(&other, at).ray);
        let bend = one.cross(&last).normalize().dot(&middle);
        assert!(bend.abs() < 0.006, "{bend} at {y}");
    }
}

#[test]
fn few_verticals_among_many_other_edges_are_enough() {
    let room = Rotation3::from_euler_angles(0.14, -0.09, 0.4);
    let (vertical, other): (Vec<_>, Vec<_>) = edges(&room)
        .into_iter()
        .enumerate()
        .partition(|(index, _)| index % 7 < 4);
    let vertical: Vec<EdgeCurve> = vertical.into_iter().map(|(_, curve)| curve).collect();
    let other: Vec<EdgeCurve> = other.into_iter().map(|(_, curve)| curve).collect();
    let all = [vertical, vec![other; 60].concat()].concat();
    let fit = RoomFit::new(&[all], &[circle()], KnownCamera::default()).unwrap();
    assert_level(&fit, &room, 0.3);
}

/// Edges that are symmetric about the center, and two circles above and below it that are equally
/// wrong.
fn rivals() -> (Vec<EdgeCurve>, [CircleGuess; 2]) {
    let room = Rotation3::from_euler_angles(0.0, 0.0, 0.4);
    let turned = room * Rotation3::from_euler_angles(0.0, 0.0, std::f64::consts::PI);
    let [cx, cy] = CENTER;
    let circles = [-9.5, 9.5].map(|shift| CircleGuess {
        center: [cx, cy + shift],
        center_sigma: 0.01,
        ..circle()
    });
    ([edges(&room), edges(&turned)].concat(), circles)
}

#[test]
fn camera_of_another_circle_is_a_rival() {
    let (all, circles) = rivals();
    let [alone, both] = [&circles[..1], &circles[..]]
        .map(|circles| RoomFit::new(std::slice::from_ref(&all), circles, KnownCamera::default()));
    assert!(alone.is_ok(), "{alone:?}");
    assert!(
        matches!(both, Err(FitRefusal::Ambiguous { .. })),
        "{both:?}"
    );
}

#[test]
fn right_side_is_the_slope_of_the_evidence() {
    let curves = edges(&Rotation3::from_euler_angles(0.14, -0.09, 0.4));
    let weights = vec![1.0; curves.len()];
    let prior = prior(&circle(), KnownCamera::default());
    let camera = RoomCamera {
        focal: FOCAL * 1.01,
        k1: -0.04,
        k2_offset: 0.001,
        center: CENTER,
        room: Rotation3::from_euler_angles(0.142, -0.088, 0.401),
    };
    let at = |camera: &RoomCamera| evaluate(camera, &curves, &weights, &prior, 1.5, true).unwrap();
    let right = at(&camera).right;
    for index in 0..PARAMETERS {
        let mut step = Parameters::zeros();
        step[index] = if index == 3 || index == 4 { 1e-3 } else { 1e-6 };
        let [before, after] = [-step, step].map(|step| at(&stepped(&camera, &step)).evidence);
        let slope = (after - before) / (2.0 * step[index]);
        let off = (slope / right[index] - 1.0).abs();
        assert!(
            off < 0.01,
            "parameter {index}: {slope}, not {}",
            right[index]
        );
    }
}

#[test]
fn halves_of_the_image_with_two_lenses_are_refused() {
    let room = Rotation3::from_euler_angles(0.14, -0.09, 0.4);
    let mut both = vec![edges(&room); 2].concat();
    for curve in &mut both {
        let factor = if curve.points[0][0] < CENTER[0] {
            0.97
        } else {
            1.03
        };
        for [x, y] in &mut curve.points {
            *x = CENTER[0] + factor * (*x - CENTER[0]);
            *y = CENTER[1] + factor * (*y - CENTER[1]);
        }
    }
    let fit = RoomFit::new(&[both], &[circle()], KnownCamera::default());
    let is_refused = matches!(
        fit,
        Err(FitRefusal::HalvesDisagree { .. } | FitRefusal::Uncertain { .. })
    );
    assert!(is_refused, "{fit:?}");
}

#[test]
fn vertical_without_edges_is_found_from_the_horizontal_ones() {
    let room = Rotation3::from_euler_angles(0.3, -0.2, 0.4);
    let triples = Triples::new();
    let near = |ray: &Ray, axis: Ray| f64::from(ray.dot(&(room * axis)).abs() > 0.995);
    let values: Vec<f64> = triples
        .rays
        .iter()
        .map(|ray| near(ray, Ray::x()) + near(ray, Ray::y()))
        .collect();
    let scores = triples.scores(&values);
    let (best, _) = scores.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    let off = best.angle(&(room * Ray::z())).to_degrees();
    assert!(off < 9.0, "{off}°");
}
