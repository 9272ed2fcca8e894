//! Tests of the assignment to strata. Known answers are in `tests/known_answers/evaluation.rs`.

use std::path::PathBuf;

use lookdown_detect::detection::BBox;

use super::*;
use crate::ImageId;

const SIDE: f64 = 600.0;

fn place(size: Option<[u32; 2]>) -> DataSetImage {
    DataSetImage {
        id: ImageId::Number(1),
        path: PathBuf::new(),
        calibration: None,
        size,
        truth: GroundTruth::default(),
    }
}

/// A square around a point.
fn square(x: f64, y: f64, side: f64) -> Outline {
    let half = side / 2.0;
    Outline::AxisParallel(BBox::new([x - half, y - half, x + half, y + half]).unwrap())
}

fn image(
    persons: impl IntoIterator<Item = AnnotatedPerson<Outline>>,
    found: impl IntoIterator<Item = Outline>,
) -> EvaluatedImage<Outline> {
    EvaluatedImage {
        truth: GroundTruth {
            persons: persons.into_iter().collect(),
            ignore_regions: Vec::new(),
        },
        detections: found
            .into_iter()
            .map(|bbox| ScoredBox { bbox, score: 0.5 })
            .collect(),
    }
}

fn strata(by: Stratification, image: &EvaluatedImage<Outline>) -> Vec<Stratum> {
    by.strata(&[(&place(Some([600, 600])), image)]).unwrap()
}

fn ap50(stratum: &Stratum) -> Option<f64> {
    stratum.figures.map(|figures| figures.ap50.all_point_area)
}

#[test]
fn a_false_positive_lowers_only_its_own_stratum() {
    let (center, rim) = (square(300.0, 300.0, 40.0), square(580.0, 300.0, 40.0));
    let wrong_at_the_rim = square(300.0, 20.0, 40.0);
    let image = image([center.into(), rim.into()], [wrong_at_the_rim, center, rim]);
    let strata = strata(Stratification::Distance, &image);
    let persons: Vec<_> = strata.iter().map(|stratum| stratum.persons).collect();
    assert_eq!(persons, [1, 0, 0, 1]);
    let ap: Vec<_> = strata.iter().map(ap50).collect();
    assert_eq!(ap, [Some(1.0), None, None, Some(0.5)]);
}

#[test]
fn a_match_with_a_person_of_another_stratum_is_ignored() {
    // The person is large and its detection medium, and they still match.
    let person = square(300.0, 300.0, 0.101 * SIDE);
    let found = square(300.0, 300.0, 0.099 * SIDE);
    let also = square(100.0, 300.0, 0.07 * SIDE);
    let strata = strata(
        Stratification::Size,
        &image([person.into(), also.into()], [found, also]),
    );
    assert_eq!(ap50(&strata[1]), Some(1.0));
    assert_eq!(ap50(&strata[2]), Some(1.0));
}

#[test]
fn a_false_positive_is_wrong_at_every_visibility() {
    let seen = |outline: Outline, fraction| AnnotatedPerson {
        visible_fraction: Some(fraction),
        ..AnnotatedPerson::from(outline)
    };
    let (hidden, open) = (square(100.0, 300.0, 40.0), square(300.0, 300.0, 40.0));
    let image = image(
        [seen(hidden, 0.3), seen(open, 1.0)],
        [square(500.0, 300.0, 40.0), hidden, open],
    );
    let strata = strata(Stratification::Visibility, &image);
    let ap: Vec<_> = strata.iter().map(ap50).collect();
    assert_eq!(ap, [Some(0.5), None, Some(0.5)]);
}

#[test]
fn strata_without_data_are_refused() {
    let person = square(300.0, 300.0, 40.0);
    let boxes = image([person.into()], []);
    let refusal = |by: Stratification, size, image: &EvaluatedImage<Outline>| {
        by.strata(&[(&place(size), image)]).unwrap_err().to_string()
    };
    let visibility = refusal(Stratification::Visibility, Some([600, 600]), &boxes);
    assert!(visibility.contains("visible_fraction"), "{visibility}");
    let distance = refusal(Stratification::Distance, None, &boxes);
    assert!(distance.contains("width and height"), "{distance}");
    let heads = image([Outline::Head([1.0, 2.0]).into()], []);
    let size = refusal(Stratification::Size, Some([600, 600]), &heads);
    assert!(size.contains("with a box"), "{size}");
}

#[test]
fn stratifications_are_known_by_their_names() {
    for &by in Stratification::VARIANTS {
        assert_eq!(by.name().parse(), Ok(by));
    }
    assert!("colour".parse::<Stratification>().is_err());
}
