//! One line of a table: the detections under one name, and their figures.

use std::{fmt, time::Duration};

use lookdown_detect::{
    detection::{BBox, FramePixels, Refinement, RefinementParameters},
    parameters::Profile,
    pipeline::Person,
};
use lookdown_lens::geometry::OrientedBox;

use super::{
    Counts, DataSet, EvaluatedImage, NoPersons, NoStrata, Outline, PrecisionRecallCurve, ScoredBox,
    Stratification, Stratum, Summary,
};

/// A person detected in an image of a data set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundPerson {
    /// Axis-parallel box, corner-origin frame pixels.
    pub bbox: BBox<FramePixels>,
    /// The box aligned with the person, if the detector returns one.
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

/// The origin of the detections of a row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RowName {
    /// The profile. `None` for detections of other programs.
    pub profile: Option<Profile>,
    /// The refinement. `None` for detections of other programs.
    pub refinement: Option<Refinement>,
    /// The model, or the name of detections of other programs.
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

/// The cost of the detections of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowCost {
    /// The mean number of views per image that ran through the network.
    pub views: f64,
    /// The mean processing time of an image: decoding, camera, views, network and this refinement.
    /// Reading the file and waiting for another image in the network are not included. Concurrent
    /// images share the cores.
    pub time_per_image: Duration,
}

/// The persons detected in a data set with one profile, refinement and model.
#[derive(Debug, Clone)]
pub struct DetectedRow {
    /// The origin.
    pub name: RowName,
    /// The parameters of the refinement. `None` for detections from a file.
    pub refinement: Option<RefinementParameters>,
    /// The cost. `None` for detections from a file.
    pub cost: Option<RowCost>,
    /// The persons detected in each image, in the order of the data set.
    pub images: Vec<Vec<FoundPerson>>,
}

/// The figures of the detections of a row.
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
    /// Scores the row against the ground truth of its data set.
    ///
    /// # Errors
    /// [`NoPersons`] if no person counts.
    pub fn evaluate(&self, data_set: &DataSet) -> Result<EvaluatedRow, NoPersons> {
        let images = self.evaluated_images(data_set);
        let curve = |min_iou| PrecisionRecallCurve::from_images(&images, min_iou);
        Ok(EvaluatedRow {
            summary: Summary::from_images(&images)?,
            curve_at_50: curve(0.5).ok_or(NoPersons)?,
            curve_at_75: curve(0.75).ok_or(NoPersons)?,
        })
    }

    /// Counts the persons of each image. The data set may have no persons.
    pub fn counts(&self, data_set: &DataSet) -> Counts {
        Counts::from_images(&self.evaluated_images(data_set))
    }

    /// Scores the row against the persons of each stratum of its data set.
    ///
    /// # Errors
    /// [`NoStrata`] if the data set lacks the property that defines the strata.
    pub fn strata(&self, data_set: &DataSet, by: Stratification) -> Result<Vec<Stratum>, NoStrata> {
        let images = self.evaluated_images(data_set);
        let images: Vec<_> = data_set.images.iter().zip(&images).collect();
        by.strata(&images)
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
