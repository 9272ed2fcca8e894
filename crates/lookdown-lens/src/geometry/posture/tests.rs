//! Known answers: boxes of articulated people, whose proportions the estimate does not know, in
//! several lenses and under cameras of several heights, with the errors of real boxes.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector3;

use super::*;
use crate::geometry::{
    lens::{Equidistant, Equisolid, Stereographic},
    oriented_box::vertical_in_frame,
    pixels::to_corner_origin,
};

/// Numbers that are the same on every machine (splitmix64, Steele et al., 2014).
struct Chance(u64);

impl Chance {
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        f64::from(u32::try_from((bits ^ (bits >> 31)) >> 32).unwrap()) / f64::from(u32::MAX)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    /// A number of mean 0 and standard deviation 1.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.share()).sum::<f64>() - 6.0
    }
}

/// The activity of a person, from which the joints follow.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Pose {
    Standing,
    Sitting,
    Crouching,
    OnFloor,
    Crawling,
    OnBack,
    OnSide,
}

impl Pose {
    fn posture(self) -> Posture {
        match self {
            Self::Standing => Posture::Upright,
            Self::Sitting => Posture::Seated,
            Self::Crouching | Self::OnFloor | Self::Crawling => Posture::Low,
            Self::OnBack | Self::OnSide => Posture::Lying,
        }
    }
}

/// A line between two joints with a radius, from the place of the person: forward, aside, up.
type Limb = (Vector3<f64>, Vector3<f64>, f64);

/// Returns the limbs of a person of `stature` meters.
fn limbs(pose: Pose, stature: f64, chance: &mut Chance) -> Vec<Limb> {
    let mut degrees = |low: f64, high: f64| chance.between(low, high).to_radians();
    let thigh = 0.245 * stature;
    let (hip_up, torso, thighs, shins, arms) = match pose {
        Pose::Standing => {
            let step = degrees(0.0, 25.0);
            (
                2.0 * thigh,
                degrees(-3.0, 10.0),
                [step, -step],
                [step - degrees(0.0, 10.0), -step],
                [degrees(-25.0, 25.0), degrees(-25.0, 60.0)],
            )
        }
        Pose::Sitting => {
            let knees = [degrees(80.0, 95.0), degrees(80.0, 95.0)];
            (
                0.47,
                degrees(-15.0, 25.0),
                knees,
                [degrees(-20.0, 25.0), degrees(-20.0, 25.0)],
                [degrees(0.0, 70.0), degrees(0.0, 70.0)],
            )
        }
        Pose::Crouching => {
            let knee = degrees(115.0, 140.0);
            (
                0.22,
                degrees(20.0, 50.0),
                [knee, knee],
                [degrees(-50.0, -20.0), degrees(-50.0, -20.0)],
                [degrees(20.0, 80.0), degrees(20.0, 80.0)],
            )
        }
        Pose::OnFloor => {
            let legs = degrees(90.0, 120.0);
            (
                0.1,
                degrees(-20.0, 25.0),
                [legs, legs],
                [degrees(50.0, 90.0), degrees(50.0, 90.0)],
                [degrees(-20.0, 50.0), degrees(-20.0, 50.0)],
            )
        }
        Pose::Crawling => {
            let step = degrees(0.0, 20.0);
            (
                thigh + 0.05,
                degrees(75.0, 90.0),
                [step, -step],
                [-FRAC_PI_2, -FRAC_PI_2],
                [degrees(-15.0, 15.0), degrees(-15.0, 15.0)],
            )
        }
        Pose::OnBack => (
            0.12,
            FRAC_PI_2,
            [degrees(-100.0, -85.0), -FRAC_PI_2],
            [-FRAC_PI_2, -FRAC_PI_2],
            [-FRAC_PI_2, degrees(-90.0, 90.0)],
        ),
        Pose::OnSide => {
            let bent = degrees(-90.0, 0.0);
            (
                0.15,
                FRAC_PI_2,
                [bent, bent],
                [degrees(-130.0, -90.0), degrees(-130.0, -90.0)],
                [degrees(-60.0, 60.0), degrees(-60.0, 60.0)],
            )
        }
    };
    let down = |angle: f64| Vector3::new(angle.sin(), 0.0, -angle.cos());
    let up = -down(-torso);
    let hip = Vector3::new(0.0, 0.0, hip_up);
    let shoulder = hip + up * (0.29 * stature);
    let aside = |meters: f64| Vector3::new(0.0, meters, 0.0);
    let mut limbs = vec![
        (hip, shoulder, 0.13),
        (shoulder, shoulder + up * (0.14 * stature), 0.1),
        (shoulder + aside(-0.18), shoulder + aside(0.18), 0.08),
    ];
    for (side, meters) in [-0.1, 0.1].into_iter().enumerate() {
        let knee = hip + aside(meters) + down(thighs[side]) * thigh;
        let foot = knee + down(shins[side]) * thigh;
        let hand = shoulder + aside(2.2 * meters) + down(arms[side]) * (0.33 * stature);
        limbs.extend([
            (hip + aside(meters), knee, 0.08),
            (knee, foot, 0.07),
            (shoulder + aside(1.9 * meters), hand, 0.05),
        ]);
    }
    if pose == Pose::OnSide {
        for (from, to, _) in &mut limbs {
            for joint in [from, to] {
                *joint = Vector3::new(joint.x, joint.z - hip_up, joint.y + 0.2);
            }
        }
    }
    limbs
}

/// A camera, and the errors of its boxes.
struct Camera {
    lens: Lens,
    mount: Mount,
}

impl Camera {
    fn any(chance: &mut Chance) -> Self {
        let lens: crate::geometry::lens::LensModel = match (chance.share() * 3.0).floor() {
            0.0 => Equidistant::with_focal(300.0, 499.5, 499.5, 1.6).into(),
            1.0 => Equisolid::with_focal(330.0, 499.5, 499.5, 1.6).into(),
            _ => Stereographic::with_focal(250.0, 499.5, 499.5, 1.55).into(),
        };
        let tilt = chance.between(0.0, 0.12);
        let up = nalgebra::Unit::new_normalize(Vector3::new(tilt.sin(), 0.0, -tilt.cos()));
        Self {
            lens: Lens::new(&lens).unwrap(),
            mount: Mount::new(up, Some(chance.between(2.4, 3.4))),
        }
    }

    /// Returns the box of limbs `out` meters away, turned by `turn`, with errors of `noise`.
    fn see(
        &self,
        limbs: &[Limb],
        [out, azimuth, turn]: [f64; 3],
        noise: [f64; 4],
    ) -> Option<BoxAngles> {
        let rotation = self.mount.camera_from_floor();
        let camera_m = self.mount.height_m()?;
        let (sin, cos) = (azimuth + turn).sin_cos();
        let mut outline = Vec::new();
        for (from, to, radius) in limbs {
            for step in 0..=4 {
                let middle = from + (to - from) * (f64::from(step) / 4.0);
                for toward in 0..26 {
                    let cell = if toward < 13 { toward } else { toward + 1 };
                    let side = |step: i32| f64::from(cell / step % 3 - 1);
                    let toward = Vector3::new(side(1), side(3), side(9)).normalize();
                    let point = middle + toward * *radius;
                    let x = out * azimuth.cos() + point.x * cos - point.y * sin;
                    let y = out * azimuth.sin() + point.x * sin + point.y * cos;
                    let ray = rotation * Ray::new(x, y, camera_m - point.z.max(0.0));
                    outline.push(to_corner_origin(self.lens.project(&ray)?));
                }
            }
        }
        let mut center = outline[0];
        let mut person = None;
        for _ in 0..3 {
            let up = vertical_in_frame(center, &self.lens, &self.mount);
            let oriented = OrientedBox::averaging(up, [(1.0, &outline[..])])?;
            center = oriented.center;
            person = Some(oriented);
        }
        let mut person = person?;
        let size = person.width.max(person.height);
        person.center += Vector3::new(noise[0], noise[1], 0.0).xy() * (0.05 * size);
        person.width *= 1.0 + 0.08 * noise[2];
        person.height *= 1.0 + 0.08 * noise[3];
        BoxAngles::new(&person, &self.lens, &self.mount)
    }
}

/// Returns the votes for a pose with standard normal errors.
fn votes(pose: Pose, errors: [f64; 2]) -> FloorVotes {
    let ([lying, low], correlation) = VOTES[pose.posture() as usize];
    let unique: f64 = 1.0 - correlation * correlation;
    let of_low = correlation * errors[0] + unique.sqrt() * errors[1];
    FloorVotes {
        lying: (lying.0 + lying.1 * errors[0]).clamp(0.0, 1.0),
        low: (low.0 + low.1 * of_low).clamp(0.0, 1.0),
    }
}

/// Returns the signs of a box without votes.
fn of_box(angles: BoxAngles) -> PostureSigns {
    PostureSigns {
        angles: Some(angles),
        votes: None,
    }
}

fn noise<const ERRORS: usize>(chance: &mut Chance) -> [f64; ERRORS] {
    std::array::from_fn(|_| chance.normal())
}

/// Adds the boxes of limbs for some seconds at 5 frames a second, with the votes for a pose: half
/// of the errors stay.
fn watch(
    belief: &mut PostureBelief,
    camera: &Camera,
    (limbs, place, pose): (&[Limb], [f64; 3], Option<Pose>),
    seconds: f64,
    chance: &mut Chance,
) {
    let lasting: [f64; 6] = noise(chance);
    let mut left = seconds;
    while left > 0.0 {
        let fresh: [f64; 6] = noise(chance);
        let [x, y, width, height, of_lying, of_low] =
            std::array::from_fn(|index| (lasting[index] + fresh[index]) / f64::sqrt(2.0));
        let angles = camera.see(limbs, place, [x, y, width, height]);
        if angles.is_some() {
            let votes = pose.map(|pose| votes(pose, [of_lying, of_low]));
            belief.pass(0.2);
            let signs = PostureSigns { angles, votes };
            belief.add(&signs, camera.mount.height_m(), 0.2);
        }
        left -= 0.2;
    }
}

/// Returns how many of 80 people in a pose have each posture, after three seconds of standing and
/// some of the pose. Who lies has fallen with the feet in place.
fn postures(pose: Pose, seconds: f64, directions: [f64; 2], has_votes: bool) -> [u32; 5] {
    let mut chance = Chance(7);
    let mut found = [0; 5];
    for case in 0..80 {
        let camera = Camera::any(&mut chance);
        let stature = chance.between(1.5, 1.95);
        let (out, azimuth) = (chance.between(1.0, 5.0), chance.between(0.0, TAU));
        let mut turn = directions[case % 2];
        let [standing, body] = [Pose::Standing, pose].map(|pose| limbs(pose, stature, &mut chance));
        let mut belief = PostureBelief::new(true);
        watch(
            &mut belief,
            &camera,
            (
                &standing,
                [out, azimuth, turn],
                has_votes.then_some(Pose::Standing),
            ),
            3.0,
            &mut chance,
        );
        let mut place = [out, azimuth, turn];
        if pose.posture() == Posture::Lying {
            let fall = chance.between(0.4, 0.9);
            let (x, y) = (out + fall * turn.cos(), fall * turn.sin());
            turn -= y.atan2(x);
            place = [x.hypot(y), azimuth + y.atan2(x), turn];
        }
        watch(
            &mut belief,
            &camera,
            (&body, place, has_votes.then_some(pose)),
            seconds,
            &mut chance,
        );
        found[belief.posture().0 as usize] += 1;
    }
    found
}

/// Across the line of sight, and along it.
const ACROSS: [f64; 2] = [FRAC_PI_2, -FRAC_PI_2];
const ALONG: [f64; 2] = [0.0, std::f64::consts::PI];

#[test]
fn people_who_stand_or_sit_are_not_lying() {
    for (pose, directions, least) in [
        (Pose::Standing, ACROSS, 70),
        (Pose::Standing, ALONG, 70),
        (Pose::Sitting, ACROSS, 65),
        (Pose::Sitting, ALONG, 25),
    ] {
        let found = postures(pose, 3.0, directions, false);
        assert!(found[Posture::Lying as usize] <= 1, "{pose:?}: {found:?}");
        let right = found[pose.posture() as usize];
        assert!(right >= least, "{pose:?}: {found:?}");
    }
}

#[test]
fn people_who_fell_lie_or_are_low() {
    for (pose, directions, least) in [
        (Pose::OnBack, ACROSS, 65),
        (Pose::OnBack, ALONG, 30),
        (Pose::OnSide, ACROSS, 65),
        (Pose::Crawling, ACROSS, 60),
        (Pose::OnFloor, ACROSS, 30),
    ] {
        let found = postures(pose, 1.0, directions, false);
        let down = found[Posture::Lying as usize] + found[Posture::Low as usize];
        assert!(down >= least, "{pose:?}: {found:?}");
    }
}

/// The shares of 1,600 people are .96 and .77.
#[test]
fn votes_tell_who_lies_along_the_line_of_sight() {
    for (pose, least) in [(Pose::OnBack, 70), (Pose::OnSide, 50)] {
        let found = postures(pose, 1.0, ALONG, true);
        assert!(
            found[Posture::Lying as usize] >= least,
            "{pose:?}: {found:?}"
        );
    }
}

#[test]
fn votes_of_networks_decide_where_the_box_fits_two_postures() {
    let mut chance = Chance(5);
    let camera = Camera::any(&mut chance);
    let body = limbs(Pose::Standing, 1.7, &mut chance);
    let angles = camera.see(&body, [2.5, 1.0, 0.0], [0.0; 4]);
    let told = |votes| {
        let mut belief = PostureBelief::new(true);
        let signs = PostureSigns { angles, votes };
        belief.add(&signs, camera.mount.height_m(), f64::INFINITY);
        belief.probability(Posture::Lying)
    };
    let lying = FloorVotes {
        lying: 0.7,
        low: 0.1,
    };
    let [with, without, untold] = [Some(lying), Some(FloorVotes::default()), None].map(told);
    assert!(
        without < untold && untold < with,
        "{without} {untold} {with}"
    );
}

#[test]
fn surest_votes_tell_of_their_posture() {
    for (lying, low, posture) in [(1.0, 0.1, Posture::Lying), (0.2, 1.0, Posture::Low)] {
        let mut belief = PostureBelief::new(true);
        let signs = PostureSigns {
            angles: None,
            votes: Some(FloorVotes { lying, low }),
        };
        for _ in 0..5 {
            belief.add(&signs, Some(3.0), f64::INFINITY);
        }
        assert_eq!(belief.posture().0, posture);
    }
}

#[test]
fn unknown_height_of_the_camera_is_learned() {
    let mut chance = Chance(3);
    let camera = Camera::any(&mut chance);
    for (pose, turn) in [(Pose::Standing, 0.0), (Pose::OnBack, FRAC_PI_2)] {
        let mut belief = PostureBelief::new(false);
        let body = limbs(pose, 1.7, &mut chance);
        let seen = camera.see(&body, [2.5, 1.0, turn], [0.0; 4]).unwrap();
        for _ in 0..10 {
            belief.pass(0.2);
            belief.add(&of_box(seen), None, 0.2);
        }
        assert_eq!(belief.posture().0, pose.posture());
    }
}

/// Returns in how many of `sessions` someone in a pose is down for 20 s, by the rule of floor
/// alerts: not after being up for 5 s, nor after a minute of sitting in a box of the same length.
/// The person stands first, then changes the limbs every two minutes. Boxes have errors, and votes
/// their distribution for the posture; both change within a minute.
fn sessions_down(pose: Pose, sessions: usize, minutes: i64) -> usize {
    let mut chance = Chance(11);
    let is_down = |chance: &mut Chance| {
        let camera = Camera::any(chance);
        let stature = chance.between(1.5, 1.95);
        let place = [
            chance.between(1.0, 5.0),
            chance.between(0.0, TAU),
            chance.between(0.0, TAU),
        ];
        let mut belief = PostureBelief::new(true);
        let standing = limbs(Pose::Standing, stature, chance);
        watch(&mut belief, &camera, (&standing, place, None), 3.0, chance);
        let (mut since, mut up_since, mut down_seconds) = (None, None, 0.0);
        let mut errors: [f64; 4] = noise(chance);
        let mut exact = None;
        let (mut length, mut seated_seconds) = (0.0, 0);
        for second in 0..60 * minutes {
            if second % 120 == 0 {
                exact = camera.see(&limbs(pose, stature, chance), place, [0.0; 4]);
            }
            let fresh: [f64; 4] = noise(chance);
            for (error, fresh) in errors.iter_mut().zip(fresh) {
                *error = 0.983 * *error + 0.18 * fresh;
            }
            let Some(exact) = exact else { return false };
            let shown = BoxAngles {
                from_nadir: exact.from_nadir,
                along: exact.along * (1.0 + 0.08 * errors[0]),
                across: exact.across * (1.0 + 0.08 * errors[1]),
            };
            let signs = PostureSigns {
                angles: Some(shown),
                votes: Some(votes(pose, [errors[2], errors[3]])),
            };
            belief.pass(1.0);
            belief.add(&signs, camera.mount.height_m(), 1.0);
            let now = shown.along.max(shown.across);
            if !(1.0 / SAME_LENGTH..=SAME_LENGTH).contains(&(length / now)) {
                (length, seated_seconds) = (now, 0);
            }
            seated_seconds += i64::from(belief.sits());
            if belief.is_down() && 1000 * seated_seconds < SETTLED_MS {
                (since, up_since) = (since.or(Some(second)), None);
            } else if belief.is_up() {
                up_since = up_since.or(Some(second));
            }
            if up_since.is_some_and(|up| 1000 * (second - up) >= UP_MS) || since.is_none() {
                (since, up_since, down_seconds) = (None, None, 0.0);
            }
            down_seconds += belief.down_probability();
            let is_alert = |since| {
                let seconds = second - since;
                seconds >= 20 && down_seconds >= MOSTLY_DOWN * seconds as f64
            };
            if since.is_some_and(is_alert) && up_since.is_none() {
                return true;
            }
        }
        false
    };
    (0..sessions).filter(|_| is_down(&mut chance)).count()
}

/// The figures of docs/count.md, from 4,000 people of each pose: N=4000 repeats them.
#[test]
fn few_people_who_sit_become_a_floor_alert() {
    let sessions = std::env::var("N").map_or(8, |sessions| sessions.parse().unwrap());
    for (pose, minutes, shares) in [
        (Pose::Standing, 10, 0.0..=0.02),
        (Pose::Sitting, 30, 0.0..=0.13),
        (Pose::Crouching, 1, 0.0..=0.3),
        (Pose::OnBack, 1, 0.8..=1.0),
        (Pose::OnSide, 1, 0.8..=1.0),
    ] {
        let down = sessions_down(pose, sessions, minutes);
        println!("{pose:?}, {minutes} min: {down} of {sessions}");
        let share = float(down) / float(sessions);
        assert!(shares.contains(&share), "{pose:?}: {down} of {sessions}");
    }
}
