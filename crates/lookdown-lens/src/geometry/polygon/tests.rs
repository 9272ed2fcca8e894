use proptest::prelude::*;

use super::*;

fn refusal(corners: &[[f64; 2]]) -> String {
    Polygon::new(corners).unwrap_err().to_string()
}

#[test]
fn concave_area_holds_only_points_inside() {
    // A U, open at its top.
    let corners = [
        [0.0, 0.0],
        [2.0, 0.0],
        [2.0, 8.0],
        [8.0, 8.0],
        [8.0, 0.0],
        [10.0, 0.0],
        [10.0, 10.0],
        [0.0, 10.0],
    ];
    let area = Polygon::new(&corners).unwrap();
    let reversed: Vec<_> = corners.into_iter().rev().collect();
    let reversed = Polygon::new(&reversed).unwrap();
    for (point, is_inside) in [
        ([1.0, 1.0], true),
        ([5.0, 9.0], true),
        ([9.0, 4.0], true),
        ([5.0, 4.0], false),
        ([5.0, -1.0], false),
        ([11.0, 9.0], false),
    ] {
        assert_eq!(area.holds(point.into()), is_inside, "{point:?}");
        assert_eq!(reversed.holds(point.into()), is_inside, "{point:?}");
    }
}

#[test]
fn corners_that_bound_no_area_are_refused_with_the_reason() {
    assert_eq!(
        refusal(&[[0.0, 0.0], [1.0, 1.0]]),
        "it has 2 corners: give 3 to 64"
    );
    assert_eq!(
        refusal(&[[0.0, 0.0]; 65]),
        "it has 65 corners: give 3 to 64"
    );
    for number in [f64::NAN, f64::INFINITY, -1.1e6] {
        let refusal = refusal(&[[0.0, 0.0], [1.0, number], [2.0, 0.0]]);
        assert!(
            refusal.starts_with(&format!("corner 2 is [1, {number}]")),
            "{refusal}"
        );
    }
    let closed = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]];
    assert!(refusal(&closed).starts_with("corners 4 and 1 are the same"));
    let bow_tie = [[0.0, 0.0], [4.0, 4.0], [4.0, 0.0], [0.0, 4.0]];
    assert!(
        refusal(&bow_tie)
            .starts_with("the edge from corner 1 to 2 meets the one from corner 3 to 4")
    );
}

#[test]
fn an_outline_that_only_touches_itself_is_refused_too() {
    let on_one_line = [[0.0, 0.0], [1.0, 1.0], [3.0, 3.0]];
    let spike = [[0.0, 0.0], [4.0, 0.0], [2.0, 0.0], [2.0, 3.0]];
    let pinched = [
        [0.0, 0.0],
        [2.0, 2.0],
        [4.0, 0.0],
        [4.0, 4.0],
        [2.0, 2.0],
        [0.0, 4.0],
    ];
    for corners in [&on_one_line[..], &spike[..], &pinched[..]] {
        assert!(refusal(corners).contains("meets"), "{corners:?}");
    }
    // A corner in the middle of a straight side is none of these.
    assert!(Polygon::new(&[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 3.0]]).is_ok());
}

#[test]
fn areas_meet_where_they_overlap_contain_each_other_or_touch() {
    let frame = Polygon::for_frame(10, 10);
    let square = |left: f64, top: f64, side: f64| {
        let (right, bottom) = (left + side, top + side);
        Polygon::new(&[[left, top], [right, top], [right, bottom], [left, bottom]]).unwrap()
    };
    for (other, met) in [
        (square(8.0, 8.0, 5.0), true),
        (square(2.0, 2.0, 1.0), true),
        (square(-5.0, -5.0, 30.0), true),
        (square(10.0, 3.0, 2.0), true),
        (square(11.0, 3.0, 2.0), false),
    ] {
        assert_eq!(frame.meets(&other), met, "{other:?}");
        assert_eq!(other.meets(&frame), met, "{other:?}");
    }
}

/// A star around the origin: always simple, and known by the distance in each direction.
fn star() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec(1.0..10.0_f64, 3..40).prop_map(|radii| {
        let step = std::f64::consts::TAU / radii.len() as f64;
        let corners = (0_u32..).zip(radii).map(|(index, radius)| {
            let angle = step * f64::from(index);
            [radius * angle.cos(), radius * angle.sin()]
        });
        corners.collect()
    })
}

proptest! {
    #[test]
    fn area_is_independent_of_start_and_direction_of_outline(
        corners in star(), begin in 0..40_usize, x in -11.0..11.0, y in -11.0..11.0,
    ) {
        let area = Polygon::new(&corners).unwrap();
        let mut turned = corners.clone();
        turned.rotate_left(begin % corners.len());
        turned.reverse();
        let turned = Polygon::new(&turned).unwrap();
        let point = Point2::new(x, y);
        prop_assert_eq!(area.holds(point), turned.holds(point));
        let scaled = area.scaled(2.0, 0.5);
        prop_assert_eq!(scaled.holds(Point2::new(2.0 * x, 0.5 * y)), area.holds(point));
    }

    #[test]
    fn every_point_is_in_one_of_the_parts_into_which_an_area_is_cut(
        corners in star(), x in -11.0..11.0, y in -11.0..11.0,
    ) {
        let area = Polygon::new(&corners).unwrap();
        let point = Point2::new(x, y);
        let following = corners.iter().cycle().skip(1);
        let parts = corners.iter().zip(following).map(|(a, b)| {
            Polygon::new(&[[0.0, 0.0], *a, *b])
        });
        let holding = parts.filter(|part| part.as_ref().unwrap().holds(point)).count();
        prop_assert_eq!(holding, usize::from(area.holds(point)));
    }

    #[test]
    fn any_corners_are_accepted_or_refused_with_a_sentence(
        corners in prop::collection::vec(prop::array::uniform2(any::<f64>()), 0..70),
    ) {
        if let Err(refusal) = Polygon::new(&corners) {
            prop_assert!(!refusal.to_string().is_empty());
        }
    }

    #[test]
    fn quadrilateral_with_exchanged_corners_crosses_itself(
        left in 0.0..4.0, right in 6.0..10.0, top in 0.0..4.0, bottom in 6.0..10.0,
    ) {
        let whole = [[left, top], [right, top], [right, bottom], [left, bottom]];
        prop_assert!(Polygon::new(&whole).is_ok());
        let crossed = [whole[0], whole[2], whole[1], whole[3]];
        prop_assert!(Polygon::new(&crossed).is_err());
    }
}

#[test]
fn the_share_of_a_frame_ends_at_its_sides() {
    for (corners, expected) in [
        (
            &[[0.0, 0.0], [50.0, 0.0], [50.0, 40.0], [0.0, 40.0]][..],
            0.5,
        ),
        (
            &[[-50.0, -10.0], [50.0, -10.0], [50.0, 50.0], [-50.0, 50.0]],
            0.5,
        ),
        (&[[0.0, 0.0], [100.0, 0.0], [0.0, 40.0]], 0.5),
        // A fork around the frame, whose tines are outside.
        (
            &[
                [-9.0, -9.0],
                [109.0, -9.0],
                [109.0, 49.0],
                [105.0, 49.0],
                [105.0, -5.0],
                [-9.0, -5.0],
            ],
            0.0,
        ),
        (
            &[[-9.0, -9.0], [999.0, -9.0], [999.0, 999.0], [-9.0, 999.0]],
            1.0,
        ),
    ] {
        for reverse in [false, true] {
            let mut corners = corners.to_vec();
            if reverse {
                corners.reverse();
            }
            let share = Polygon::new(&corners).unwrap().share_of_frame(100, 40);
            assert!((share - expected).abs() < 1e-9, "{share}");
        }
    }
}
