//! Follows persons between searches of the whole frame, as the server does with `follow`. Moving
//! persons stand for the cells with motion.

use lookdown_lens::geometry::OrientedBox;
use lookdown_tracking::follow::{
    FollowedPeople, FoundPerson, JOINED_CELLS, LEAST_FILL, SEARCH_EVERY_S, from_logit, logit,
    overlap, widened,
};

use crate::detector::{Camera, FRAME_PX, Found, Shown, bounds};

/// Side of a cell of the motion detection, pixels.
const CELL_PX: f64 = FRAME_PX / 64.0;
/// Least shift of a person that changes a cell, pixels.
const MOVED_PX: f64 = CELL_PX / 8.0;
/// The least margin of a crop around the expected box of its person, as a share of the larger side.
const CROP_MARGIN: f64 = 0.5;
/// The least score of a box that makes a new person.
const NEW_SCORE: f64 = 0.06;

type Bounds = [f64; 4];

/// The followed persons of a camera.
#[derive(Default)]
pub struct Follow {
    state: Option<State>,
    /// Frames that were searched, and all frames.
    pub searches: [usize; 2],
}

struct State {
    searched_s: f64,
    /// The persons that the searched frame shows.
    shown: Vec<Shown>,
    people: FollowedPeople<Found>,
}

impl FoundPerson for Found {
    fn bounds(&self) -> Bounds {
        bounds(&self.oriented)
    }

    fn upright_box(&self) -> OrientedBox {
        self.oriented
    }

    fn score(&self) -> f64 {
        from_logit(self.logit)
    }

    fn with_score(self, score: f64) -> Self {
        Self {
            logit: logit(score),
            ..self
        }
    }
}

impl Follow {
    /// The boxes of a frame at `at_s`, by a search or by crops.
    pub fn find(&mut self, camera: &mut Camera, at_s: f64, shown: &[Shown]) -> Vec<Found> {
        self.searches[1] += 1;
        let before = self.state.take();
        let followed = before.as_ref().and_then(|state| state.moving(at_s, shown));
        let (mut state, moving) = match (before, followed) {
            (Some(state), Some(moving)) => (state, moving),
            (before, _) => {
                let before = before.map(|before| before.people);
                return self.search(camera, at_s, shown, before.as_ref());
            }
        };
        let expected = state.people.expected(&moving, at_s);
        let fill = state.people.most_fill(&moving, at_s);
        let crops: Vec<Bounds> = expected.map(|(_, expected)| crop(expected, fill)).collect();
        let found = camera.search_crops(at_s, shown, |oriented| {
            let [x, y] = [oriented.center.x, oriented.center.y];
            crops.iter().any(|crop| overlap(crop, &[x, y, x, y]))
        });
        let found = found.into_iter().filter(|one| one.logit.is_finite());
        let place = |_: &Found, score, oriented| Found {
            oriented,
            logit: logit(score),
        };
        let people = state.people.clone();
        state
            .people
            .confirm(&moving, found.collect(), at_s, NEW_SCORE, place);
        if people.are_lost_in(&state.people, NEW_SCORE) {
            return self.search(camera, at_s, shown, Some(&people));
        }
        let seen = state.people.seen().copied().collect();
        self.state = Some(state);
        seen
    }

    fn search(
        &mut self,
        camera: &mut Camera,
        at_s: f64,
        shown: &[Shown],
        before: Option<&FollowedPeople<Found>>,
    ) -> Vec<Found> {
        self.searches[0] += 1;
        let found = camera.search(at_s, shown);
        let seen = found.iter().filter(|found| found.score() >= NEW_SCORE);
        let seen: Vec<Found> = seen.copied().collect();
        self.state = Some(State {
            searched_s: at_s,
            shown: shown.to_vec(),
            people: FollowedPeople::from_search(&seen, at_s, before),
        });
        found
    }
}

impl State {
    /// The persons with motion; `None` if the frame must be searched.
    fn moving(&self, at_s: f64, shown: &[Shown]) -> Option<Vec<bool>> {
        if at_s - self.searched_s >= SEARCH_EVERY_S {
            return None;
        }
        let moved = self.motion(shown);
        let others = self
            .people
            .unexplained(&moved, JOINED_CELLS * CELL_PX, at_s);
        let moving = self.people.moving(&moved, at_s);
        let can_follow = others.is_empty() && self.people.most_fill(&moving, at_s) >= LEAST_FILL;
        can_follow.then_some(moving)
    }

    /// The bounds of persons that have moved since the search, where they were and where they are.
    fn motion(&self, shown: &[Shown]) -> Vec<Bounds> {
        let mut moved = Vec::new();
        let twin = |all: &[Shown], id| all.iter().find(|other| other.id == id).copied();
        for now in shown {
            match twin(&self.shown, now.id) {
                Some(then) if (then.oriented.center - now.oriented.center).norm() < MOVED_PX => {}
                Some(then) => moved.extend([bounds(&then.oriented), bounds(&now.oriented)]),
                None => moved.push(bounds(&now.oriented)),
            }
        }
        let gone = self
            .shown
            .iter()
            .filter(|then| twin(shown, then.id).is_none());
        moved.extend(gone.map(|then| bounds(&then.oriented)));
        moved
    }
}

/// The part of the frame that a crop around an expected box shows, of which people fill at most the
/// share `most_fill`.
fn crop(expected: Bounds, most_fill: f64) -> Bounds {
    let [x_min, y_min, x_max, y_max] = expected;
    let margin = CROP_MARGIN.max((1.0 / most_fill - 1.0) / 2.0);
    widened(expected, margin * (x_max - x_min).max(y_max - y_min))
}
