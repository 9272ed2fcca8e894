//! The figures by kind of person: far and near, small and large, occluded and fully visible.
//!
//! A stratum is evaluated as COCO evaluates its area ranges. Persons outside it need not be
//! detected, and their detections are ignored. A detection that matches no person is wrong in the
//! stratum that it belongs to itself.

use strum::{EnumString, IntoStaticStr, VariantArray};

use super::{
    AnnotatedPerson, AveragePrecision, DataSetImage, EvaluatedImage, GroundTruth, Outcome, Outline,
    PrecisionRecallCurve, ScoredBox, matching::outcomes,
};

/// `O_t` of the figures.
const MIN_IOU: f64 = 0.5;

/// A property by which persons are grouped.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, EnumString, IntoStaticStr, VariantArray, strum::VariantNames,
)]
#[strum(serialize_all = "snake_case")]
pub enum Stratification {
    /// Distance from the center: the angle between the optical axis and the ray to the center of
    /// the box. It uses the calibrated lens, or else the equidistant lens of 180° with the largest
    /// circle in the frame.
    Distance,
    /// Size: the square root of the box's area relative to the frame's shorter side. Unlike COCO's
    /// sizes in pixels it does not depend on the resolution of the sensor.
    Size,
    /// The visible fraction of the person. A detection has none, so a detection that matches no
    /// person is wrong in every stratum.
    Visibility,
}

/// The persons whose value lies in `from..until`.
struct Range {
    name: &'static str,
    from: f64,
    until: f64,
}

/// The figures of one stratum at `O_t` = 0.5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stratum {
    /// The range of the persons, with its unit.
    pub name: &'static str,
    /// The number of persons that count.
    pub persons: usize,
    /// Average precision and recall. `None` if no person counts.
    pub figures: Option<StratumFigures>,
}

/// The figures of the detections of a stratum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StratumFigures {
    /// Average precision.
    pub ap50: AveragePrecision,
    /// The fraction of persons matched by any detection, 0 to 1.
    pub recall: f64,
}

/// The data set lacks the property that defines the strata.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("persons cannot be grouped by {by}: {missing}")]
pub struct NoStrata {
    by: &'static str,
    missing: &'static str,
}

impl Stratification {
    /// Returns the name, as in a flag.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the figures of each stratum. `images` are those of a data set, with their
    /// detections.
    ///
    /// # Errors
    /// [`NoStrata`] if the data set does not state the property of any person.
    pub fn strata(
        self,
        images: &[(&DataSetImage, &EvaluatedImage<Outline>)],
    ) -> Result<Vec<Stratum>, NoStrata> {
        let images: Vec<_> = images
            .iter()
            .map(|(place, image)| Measured::new(self, place, image))
            .collect();
        if images
            .iter()
            .all(|image| image.persons.iter().all(Option::is_none))
        {
            return Err(NoStrata {
                by: self.name(),
                missing: self.missing(),
            });
        }
        let ranges = self.ranges().iter();
        Ok(ranges.map(|range| range.stratum(&images)).collect())
    }

    fn ranges(self) -> &'static [Range] {
        const fn range(name: &'static str, from: f64, until: f64) -> Range {
            Range { name, from, until }
        }
        const DISTANCE: [Range; 4] = [
            range("0° to 30° off the axis", 0.0, 30.0),
            range("30° to 50° off the axis", 30.0, 50.0),
            range("50° to 70° off the axis", 50.0, 70.0),
            range("70° off the axis and more", 70.0, f64::INFINITY),
        ];
        const SIZE: [Range; 3] = [
            range("small: below 5% of the frame's side", 0.0, 0.05),
            range("medium: 5% to 10% of the frame's side", 0.05, 0.1),
            range(
                "large: 10% of the frame's side and more",
                0.1,
                f64::INFINITY,
            ),
        ];
        const VISIBILITY: [Range; 3] = [
            range("less than half visible", 0.0, 0.5),
            range("50% to 90% visible", 0.5, 0.9),
            range("90% visible and more", 0.9, f64::INFINITY),
        ];
        match self {
            Self::Distance => &DISTANCE,
            Self::Size => &SIZE,
            Self::Visibility => &VISIBILITY,
        }
    }

    fn missing(self) -> &'static str {
        match self {
            Self::Distance => {
                "no image has a person, and a calibration or a width and height in the annotations"
            }
            Self::Size => {
                "no image has a person with a box, and a width and height in the annotations or a \
                 calibration"
            }
            Self::Visibility => "no annotation has a visible_fraction",
        }
    }

    /// The value of an outline. `None` if it is not known.
    fn measure(self, place: &DataSetImage, outline: &Outline) -> Option<f64> {
        match self {
            Self::Distance => place.off_axis_deg(outline.center()),
            Self::Size => {
                let [width, height] = place.frame_size()?;
                Some(outline.area()?.sqrt() / f64::from(width.min(height)))
            }
            Self::Visibility => None,
        }
    }
}

/// An image with the value of every person and of every detection.
struct Measured<'a> {
    by: Stratification,
    image: &'a EvaluatedImage<Outline>,
    persons: Vec<Option<f64>>,
    detections: Vec<Option<f64>>,
}

impl<'a> Measured<'a> {
    fn new(by: Stratification, place: &DataSetImage, image: &'a EvaluatedImage<Outline>) -> Self {
        let of_person = |person: &AnnotatedPerson<Outline>| match by {
            Stratification::Visibility => person.visible_fraction,
            _ => by.measure(place, &person.outline),
        };
        let of_detection = |detection: &ScoredBox<Outline>| by.measure(place, &detection.bbox);
        Self {
            by,
            image,
            persons: image.truth.persons.iter().map(of_person).collect(),
            detections: image.detections.iter().map(of_detection).collect(),
        }
    }
}

impl Range {
    fn holds(&self, value: f64) -> bool {
        (self.from..self.until).contains(&value)
    }

    fn stratum(&self, images: &[Measured<'_>]) -> Stratum {
        let mut persons = 0;
        let mut scored = Vec::new();
        for measured in images {
            let truth = self.truth(measured);
            persons += truth.person_count();
            let detections = &measured.image.detections;
            let of_image = outcomes(detections, &truth, MIN_IOU);
            for ((detection, value), outcome) in
                detections.iter().zip(&measured.detections).zip(of_image)
            {
                let elsewhere = measured.by != Stratification::Visibility
                    && !value.is_some_and(|value| self.holds(value));
                let outcome = match outcome {
                    Outcome::FalsePositive if elsewhere => Outcome::Ignored,
                    outcome => outcome,
                };
                scored.push((detection.score, outcome));
            }
        }
        let curve = PrecisionRecallCurve::from_outcomes(scored.into_iter(), persons);
        Stratum {
            name: self.name,
            persons,
            figures: curve.map(|curve| StratumFigures {
                ap50: curve.average_precision(),
                recall: curve.final_recall(),
            }),
        }
    }

    /// The ground truth in which only the persons of this range count.
    fn truth(&self, measured: &Measured<'_>) -> GroundTruth<Outline> {
        let truth = &measured.image.truth;
        let persons = truth.persons.iter().zip(&measured.persons);
        GroundTruth {
            persons: persons
                .map(|(person, value)| AnnotatedPerson {
                    counts: person.counts && value.is_some_and(|value| self.holds(value)),
                    ..*person
                })
                .collect(),
            ignore_regions: truth.ignore_regions.clone(),
        }
    }
}

#[cfg(test)]
mod tests;
