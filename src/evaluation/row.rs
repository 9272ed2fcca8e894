//! One line of a table: what was found under one name, and how good it was.

use std::{fmt, time::Duration};

use super::{
    DataSet, EvaluatedImage, MatchingRule, NoPersons, NoStrata, Outline, PrecisionRecallCurve,
    ScoredBox, Stratification, Stratum, Summary,
};
use crate::{
    detection::{BBox, FramePixels, Refinement, RefinementParameters},
    geometry::OrientedBox,
    pipeline::{Person, Profile},
};

/// How detections are matched with the truth.
const RULE: MatchingRule = MatchingRule::Coco;

/// A person found in an image of a data set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundPerson {
    /// Axis-parallel box, corner-origin frame pixels.
    pub bbox: BBox<FramePixels>,
    /// The box turned along the person, where the detector gives one.
    pub oriented_box: Option<OrientedBox>,
    /// Confidence, 0 to 1.
    pub score: f64,
}

impl From<&Person> for FoundPerson {
    fn from(person: &Person) -> Self {
        Self {
            bbox: person.bbox,
            oriented_box: Some(person.oriented_box),
            score: person.score,
        }
    }
}

/// Who found the persons of a row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowName {
    /// The profile; `None` of detections that are not Lookdown's.
    pub profile: Option<Profile>,
    /// The refinement; `None` of detections that are not Lookdown's.
    pub refinement: Option<Refinement>,
    /// The model, or what detections from elsewhere are called.
    pub model: String,
}

/// `profile refinement model`, as far as they are known.
impl fmt::Display for RowName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let (Some(profile), Some(refinement)) = (self.profile, self.refinement) {
            write!(f, "{} {refinement} ", profile.name())?;
        }
        f.write_str(&self.model)
    }
}

/// What it took to find the persons of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowCost {
    /// How many views the network saw per image, on average.
    pub views: f64,
    /// Mean time in which an image was worked on: decoding, camera, views, network and this
    /// refinement. Reading the file and waiting for another image in the network do not count;
    /// images in flight share the cores.
    pub time_per_image: Duration,
}

/// The persons found in a data set by one profile, refinement and model.
#[derive(Debug, Clone)]
pub struct DetectedRow {
    /// Who found them.
    pub name: RowName,
    /// The numbers of the refinement; `None` of detections from a file.
    pub refinement: Option<RefinementParameters>,
    /// What it took; `None` of detections from a file.
    pub cost: Option<RowCost>,
    /// The persons found in each image, in the order of the data set.
    pub images: Vec<Vec<FoundPerson>>,
}

/// How good the detections of a row are.
#[derive(Debug, Clone)]
pub struct EvaluatedRow {
    /// The figures.
    pub summary: Summary,
    /// Precision and recall at `O_t` = 0.5.
    pub curve_at_50: PrecisionRecallCurve,
    /// Precision and recall at `O_t` = 0.75.
    pub curve_at_75: PrecisionRecallCurve,
}

impl DetectedRow {
    /// Scores the row against the truth of its data set.
    ///
    /// # Errors
    /// [`NoPersons`] when there is nobody to be found.
    pub fn evaluate(&self, data_set: &DataSet) -> Result<EvaluatedRow, NoPersons> {
        let images = self.evaluated_images(data_set);
        let curve = |min_iou| PrecisionRecallCurve::of_images(&images, RULE, min_iou);
        Ok(EvaluatedRow {
            summary: Summary::of_images(&images, RULE)?,
            curve_at_50: curve(0.5).ok_or(NoPersons)?,
            curve_at_75: curve(0.75).ok_or(NoPersons)?,
        })
    }

    /// Scores the row against the persons of each stratum of its data set.
    ///
    /// # Errors
    /// [`NoStrata`] when the data set does not say what persons are told apart by.
    pub fn strata(&self, data_set: &DataSet, by: Stratification) -> Result<Vec<Stratum>, NoStrata> {
        let images = self.evaluated_images(data_set);
        let images: Vec<_> = data_set.images.iter().zip(&images).collect();
        by.strata(&images, RULE)
    }

    fn evaluated_images(&self, data_set: &DataSet) -> Vec<EvaluatedImage<Outline>> {
        let images = data_set.images.iter().zip(&self.images);
        images
            .map(|(image, found)| EvaluatedImage {
                truth: image.truth.clone(),
                detections: found
                    .iter()
                    .map(|person| ScoredBox {
                        bbox: data_set.outline(image, person.bbox, person.oriented_box.as_ref()),
                        score: person.score,
                    })
                    .collect(),
            })
            .collect()
    }
}
