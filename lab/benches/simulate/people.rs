//! Persons who walk through a hall, stop, sit, lean and stand behind things, with distance from
//! each other.

use nalgebra::Vector2;

use crate::chance::Chance;

/// Time step of the walks, seconds.
pub const STEP_S: f64 = 0.02;
/// Time in which a person adopts a new velocity, seconds.
const RELAXATION_S: f64 = 0.5;
/// Persons nearer than this walk apart, meters.
const PERSONAL_M: f64 = 1.0;
/// Acceleration apart at no distance, meters per square second.
const REPULSION: f64 = 8.0;
/// Share of that acceleration that turns both to their right, so that they pass each other.
const DODGE: f64 = 0.5;
/// Least distance of the axes of two bodies, meters.
const BODY_M: f64 = 0.5;
/// Share of waypoints at which a person stops, and the longest stop in seconds.
const PAUSES: f64 = 0.3;
const LONGEST_PAUSE_S: f64 = 8.0;

/// Share of the stops at which a person sits, and the longest time of it in seconds.
const SEATS: f64 = 0.4;
const LONGEST_SEAT_S: f64 = 60.0;
/// Height of a seated person as a share of the standing one (ISO 7250: 0.92 + 0.44 of 1.75 m).
const SEATED_HEIGHT: f64 = 0.78;
/// Share of the stops at which a table or a counter hides the legs.
const HIDDEN_LEGS: f64 = 0.4;
/// Heights of a table and of a counter, meters.
const TABLE_M: f64 = 0.72;
const COUNTER_M: f64 = 0.95;
/// Distance of the head of a person who stops from above the feet, meters (standard deviation).
const LEAN_M: f64 = 0.15;

/// Time in which a person sits down, stands up or goes behind a table, seconds.
const CHANGE_S: f64 = 1.5;

/// The visible part of a person above a place of the floor.
#[derive(Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "their unit")]
pub struct Body {
    pub top_m: f64,
    /// The height from which on the person is seen.
    pub hidden_m: f64,
    /// From above the place to the head.
    pub lean_m: Vector2<f64>,
}

/// The walls of the hall, meters: half the extent along x and y.
#[derive(Clone, Copy)]
pub struct Hall(pub Vector2<f64>);

/// A walking person.
pub struct Person {
    pub id: u64,
    pub place: Vector2<f64>,
    height_m: f64,
    /// The visible part while the person stops, and how far the body is on its way there.
    rest: Body,
    rest_share: f64,
    velocity: Vector2<f64>,
    speed: f64,
    waypoints: Vec<Vector2<f64>>,
    pause_s: f64,
}

/// The persons in a hall. A new person comes through a door after another one has left.
pub struct People {
    pub present: Vec<Person>,
    hall: Hall,
    count: usize,
    next_id: u64,
}

impl People {
    pub fn new(hall: Hall, count: usize, chance: &mut Chance) -> Self {
        let mut people = Self {
            present: Vec::new(),
            hall,
            count,
            next_id: 1,
        };
        for _ in 0..count {
            let place = hall.inside(chance);
            people.add(place, chance);
        }
        people
    }

    fn add(&mut self, place: Vector2<f64>, chance: &mut Chance) {
        let stops = 2 + chance.count(2.0);
        let mut waypoints = vec![self.hall.door(chance)];
        waypoints.extend((0..stops).map(|_| self.hall.inside(chance)));
        let height_m = 1.7 + 0.1 * chance.normal();
        self.present.push(Person {
            id: self.next_id,
            place,
            height_m,
            rest: Body::standing(height_m),
            rest_share: 0.0,
            velocity: Vector2::zeros(),
            speed: (1.2 + 0.25 * chance.normal()).clamp(0.5, 2.0),
            waypoints,
            pause_s: 0.0,
        });
        self.next_id += 1;
    }

    /// Moves everyone by one step.
    pub fn step(&mut self, chance: &mut Chance) {
        let places: Vec<_> = self.present.iter().map(|person| person.place).collect();
        for person in &mut self.present {
            person.step(&places, chance);
        }
        self.keep_bodies_apart();
        self.present.retain(|person| !person.waypoints.is_empty());
        // A new person after five seconds on average.
        if self.present.len() < self.count && chance.happens(STEP_S / 5.0) {
            let door = self.hall.door(chance);
            self.add(door, chance);
        }
    }
}

impl People {
    fn keep_bodies_apart(&mut self) {
        for first in 1..self.present.len() {
            let (before, after) = self.present.split_at_mut(first);
            let one = &mut after[0];
            for other in before {
                let apart = one.place - other.place;
                let distance = apart.norm();
                if distance > 0.0 && distance < BODY_M {
                    let push = apart / distance * ((BODY_M - distance) / 2.0);
                    one.place += push;
                    other.place -= push;
                }
            }
        }
    }
}

impl Body {
    /// Returns a person who stands upright, and whom nothing hides.
    pub fn standing(height_m: f64) -> Self {
        Self {
            top_m: height_m,
            hidden_m: 0.0,
            lean_m: Vector2::zeros(),
        }
    }
}

impl Person {
    /// Returns the visible part of the person now.
    pub fn body(&self) -> Body {
        let share = self.rest_share;
        Body {
            top_m: self.height_m + share * (self.rest.top_m - self.height_m),
            hidden_m: share * self.rest.hidden_m,
            lean_m: share * self.rest.lean_m,
        }
    }

    /// Begins a stop: standing or seated, with free or hidden legs, and with a lean.
    fn stop(&mut self, chance: &mut Chance) {
        let is_seated = chance.happens(SEATS);
        let is_hidden = chance.happens(HIDDEN_LEGS);
        let (top, furniture_m, longest_s) = if is_seated {
            (SEATED_HEIGHT, TABLE_M, LONGEST_SEAT_S)
        } else {
            (1.0, COUNTER_M, LONGEST_PAUSE_S)
        };
        self.pause_s = chance.uniform(0.0, longest_s);
        self.rest = Body {
            top_m: top * self.height_m,
            hidden_m: if is_hidden { furniture_m } else { 0.0 },
            lean_m: Vector2::new(chance.normal(), chance.normal()) * LEAN_M,
        };
    }

    fn step(&mut self, places: &[Vector2<f64>], chance: &mut Chance) {
        let Some(&target) = self.waypoints.last() else {
            return;
        };
        let way = target - self.place;
        if way.norm() < 0.4 {
            self.waypoints.pop();
            if chance.happens(PAUSES) {
                self.stop(chance);
            }
            return;
        }
        self.pause_s -= STEP_S;
        let share_step = STEP_S / CHANGE_S * if self.pause_s > CHANGE_S { 1.0 } else { -1.0 };
        self.rest_share = (self.rest_share + share_step).clamp(0.0, 1.0);
        let wanted = if self.pause_s > 0.0 {
            Vector2::zeros()
        } else {
            way.normalize() * self.speed
        };
        let mut acceleration = (wanted - self.velocity) / RELAXATION_S;
        for place in places {
            let apart = self.place - place;
            let distance = apart.norm();
            if distance > 0.0 && distance < PERSONAL_M {
                let push = apart / distance * REPULSION * (1.0 - distance / PERSONAL_M);
                acceleration += push + Vector2::new(-push.y, push.x) * DODGE;
            }
        }
        // A sway that keeps walks from being straight.
        let sway = Vector2::new(chance.normal(), chance.normal()) * (0.4 / STEP_S.sqrt());
        self.velocity += (acceleration + sway) * STEP_S;
        self.place += self.velocity * STEP_S;
    }
}

impl Hall {
    fn inside(self, chance: &mut Chance) -> Vector2<f64> {
        let [x, y] = (self.0 - Vector2::new(0.7, 0.7)).into();
        Vector2::new(chance.uniform(-x, x), chance.uniform(-y, y))
    }

    fn door(self, chance: &mut Chance) -> Vector2<f64> {
        let [x, y] = self.0.into();
        // Wide openings at both ends.
        let door_y = chance.uniform(-0.8, 0.8);
        let side = if chance.happens(0.5) { 1.0 } else { -1.0 };
        Vector2::new(side * x, door_y * y)
    }
}
