use nalgebra::Vector2;

use super::*;

#[derive(Debug, Clone, Copy)]
struct Found {
    x: f64,
    score: f64,
}

impl FoundPerson for Found {
    fn bounds(&self) -> [f64; 4] {
        [self.x, 0.0, self.x + 40.0, 100.0]
    }

    fn upright_box(&self) -> OrientedBox {
        OrientedBox {
            center: nalgebra::Point2::new(self.x + 20.0, 50.0),
            width: 40.0,
            height: 100.0,
            angle: 0.0,
            up: -Vector2::y(),
        }
    }

    fn score(&self) -> f64 {
        self.score
    }

    fn with_score(self, score: f64) -> Self {
        Self { score, ..self }
    }
}

fn placed(found: &Found, score: f64, _: OrientedBox) -> Found {
    found.with_score(score)
}

/// One person, found by a search at 0 s and by a crop 10 pixels further at 0.2 s.
fn walker() -> FollowedPeople<Found> {
    let found = |x, score| Found { x, score };
    let mut people = FollowedPeople::from_search(&[found(0.0, 0.8)], 0.0, None);
    people.confirm(&[true], vec![found(10.0, 0.6)], 0.2, 0.3, placed);
    people
}

fn assert_close(actual: f64, expected: f64) {
    assert!((actual - expected).abs() < 1e-9, "{actual}, not {expected}");
}

#[test]
fn a_walker_is_expected_further_on_its_way() {
    let walker = walker();
    let (_, expected) = walker.expected(&[true], 0.4).next().unwrap();
    // The mean of no motion and of 50 pixels per second, for 0.2 s.
    assert_close(expected[0], 15.0);
}

#[test]
fn a_crop_keeps_the_odds_of_the_search() {
    let mut walker = walker();
    let score = |people: &FollowedPeople<Found>| people.seen().next().unwrap().score;
    assert_close(score(&walker), 0.8);
    let next = Found {
        x: 18.0,
        score: 0.7,
    };
    walker.confirm(&[true], vec![next], 0.4, 0.3, placed);
    assert_close(logit(score(&walker)), logit(0.7) + logit(0.8) - logit(0.6));
}

#[test]
fn a_weak_box_at_the_expected_place_hides_no_person() {
    let mut walker = walker();
    let found = |x, score| Found { x, score };
    let weak_and_person = vec![found(15.0, 0.001), found(25.0, 0.6)];
    walker.confirm(&[true], weak_and_person, 0.4, 0.3, placed);
    let seen: Vec<f64> = walker.seen().map(|person| person.x).collect();
    assert_eq!(seen, [25.0]);
}

#[test]
fn someone_a_box_further_is_the_same_person_later() {
    let found = |x| [Found { x, score: 0.8 }];
    let first = FollowedPeople::from_search(&found(0.0), 0.0, None);
    for (x, is_same) in [(80.0, true), (140.0, false)] {
        let mut crops = first.clone();
        crops.confirm(&[true], found(x).to_vec(), 0.5, 0.3, placed);
        assert_eq!(!first.are_lost_in(&crops, 0.3), is_same, "{x}");
        let search = FollowedPeople::from_search(&found(x), 0.5, Some(&first));
        assert_eq!(search.has_missed, !is_same, "{x}");
    }
}

#[test]
fn crops_are_wider_the_longer_the_way_may_be() {
    let walker = walker();
    let fill = |at_s| walker.most_fill(&[true], at_s);
    // .5 and .3 of 25 pixels per second, in boxes of 100 pixels: .575 of them in a second.
    assert_close(fill(1.2), 1.0 / (1.0 + 2.0 * 0.575));
    assert_close(fill(0.2), 1.0);
    assert_close(walker.most_fill(&[false], 1.2), 1.0);
}

#[test]
fn a_walker_whom_a_search_misses_is_expected_for_a_second() {
    let walker = walker();
    let after = |at_s| FollowedPeople::from_search(&[], at_s, Some(&walker));
    assert_eq!(after(0.9).expected(&[true], 0.9).count(), 1);
    assert_eq!(after(0.9).seen().count(), 0);
    assert_eq!(after(1.3).expected(&[true], 1.3).count(), 0);
}

#[test]
fn someone_new_or_lost_is_settled_by_further_searches() {
    let searched = |people: &FollowedPeople<Found>, score: Option<f64>| {
        let found: Vec<_> = score
            .map(|score| Found { x: 0.0, score })
            .into_iter()
            .collect();
        FollowedPeople::from_search(&found, 1.0, Some(people))
    };
    let empty = FollowedPeople::from_search(&[], 0.0, None);
    assert!(searched(&empty, Some(0.2)).are_settled());
    let mut people = searched(&empty, Some(0.7));
    for _ in 0..2 {
        assert!(!people.are_settled());
        people = searched(&people, Some(0.7));
    }
    assert!(people.are_settled());
    let lost = searched(&people, None);
    assert!(!lost.are_settled());
    assert!(searched(&lost, None).are_settled());
}

#[test]
fn motion_needs_a_search_unless_it_is_joined_to_a_person() {
    let walker = walker();
    let near = [85.0, 40.0, 95.0, 50.0];
    let joined = [105.0, 40.0, 115.0, 50.0];
    let far = [300.0, 40.0, 310.0, 50.0];
    let unexplained = |moved: &[[f64; 4]]| walker.unexplained(moved, 20.0, 0.2);
    assert_eq!(unexplained(&[joined, near, far]), [2]);
    assert_eq!(unexplained(&[joined, far]), [0, 1]);
}

#[test]
fn people_without_motion_stay_as_they_were() {
    let mut people = FollowedPeople::from_search(&[Found { x: 0.0, score: 0.8 }], 0.0, None);
    let still = people.moving(&[[300.0, 0.0, 310.0, 10.0]], 0.2);
    assert_eq!(still, [false]);
    people.confirm(&still, vec![Found { x: 9.0, score: 0.5 }], 0.2, 0.3, placed);
    let seen: Vec<_> = people.seen().map(|one| (one.x, one.score)).collect();
    assert_eq!(seen, [(0.0, 0.8)]);
}

#[test]
fn a_single_lucky_score_of_a_search_counts_half() {
    let no_one = FollowedPeople::<Found>::from_search(&[], 0.0, None);
    let people = FollowedPeople::from_search(&[Found { x: 0.0, score: 0.8 }], 1.0, Some(&no_one));
    let score = people.seen().next().unwrap().score;
    assert_close(logit(score), f64::midpoint(logit(0.05), logit(0.8)));
}
