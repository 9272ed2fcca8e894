//! Merges boxes of views into persons of the frame.

#[cfg(test)]
mod properties;

use std::collections::BTreeMap;

use lookdown_lens::geometry::{
    BoxAngles, FloorVotes, OrientedBox, PersonHeight, Posture, PostureBelief, PostureSigns,
    crop_placement::CropTarget,
    floor::{bearing, floor_position},
    oriented_box::vertical_in_frame,
};

use super::{
    Person,
    camera_rig::CameraRig,
    pass::{Mapped, Pass, views_holding},
    plausibility::score_weight,
};
use crate::{
    detection::{
        BBox, Candidate, FramePixels, MergedDetection, Refinement, RefinementParameters, refine,
    },
    parameters::{Profile, ScoreCalibration, Tuning},
};

/// The weight of the coordinates of a virtual view's box, relative to the exact box of a crop.
const VIRTUAL_VIEW_WEIGHT: f64 = 0.1;
/// The factor for scores of people on the floor: at equal scores, the network invents more of them.
/// With .85, `fast` finds .68 instead of .64 of the lying people of 60 rendered frames, but
/// photographs have 5.3 instead of 3.4 false people.
const FLOOR_VOTE: f64 = 0.75;

impl Mapped {
    /// Returns the candidate with its score weighted by its plausibility as a person, and with the
    /// number of views that hold the whole person.
    /// `crop_vote` is the factor for scores from crops.
    fn weighted(&self, passes: &[Pass], rig: &CameraRig, crop_vote: f64) -> Candidate {
        let mount = &rig.geometry.mount;
        // People on the floor are long and low in any direction.
        let extremities = self
            .footprint
            .extremities
            .filter(|_| self.posture.is_none());
        let height_ratio = extremities.and_then(|extremities| extremities.height_ratio(mount));
        let holding = views_holding(passes, &self.footprint, self.posture.is_some());
        let expected_views = holding.max(1) as f64;
        let vote = match (self.is_exact, self.posture) {
            (_, Some(_)) => FLOOR_VOTE,
            (true, None) => crop_vote,
            (false, None) => 1.0,
        };
        let weight = if self.is_exact {
            1.0
        } else {
            VIRTUAL_VIEW_WEIGHT
        };
        Candidate {
            score: self.candidate.score * score_weight(self.cut_off, height_ratio, mount) * vote,
            coordinate_weight: self.candidate.coordinate_weight * weight,
            expected_views,
            ..self.candidate
        }
    }
}

/// Maps the boxes of every view to the frame and merges them into persons.
pub(super) fn persons(
    passes: &[Pass],
    profile: Profile,
    tuning: &Tuning,
    parameters: &RefinementParameters,
) -> Vec<Person> {
    let Some(Pass { rig, .. }) = passes.first() else {
        return Vec::new();
    };
    let calibration = ScoreCalibration::new(tuning, parameters.refinement);
    let parameters = RefinementParameters {
        score_threshold: calibration.merged(parameters.score_threshold),
        ..*parameters
    };
    // Suppression compares the scores of persons alone.
    let with_postures = parameters.refinement == Refinement::Fusion;
    let (mapped, merged) = merged(passes, rig, profile, tuning, &parameters, with_postures);
    merged
        .into_iter()
        .filter_map(|merged| {
            let members = members(&merged, &mapped);
            let score = calibration.reported(merged.score);
            let votes = with_postures
                .then(|| floor_votes(&members, passes))
                .flatten();
            person(merged.bbox, score, &members, votes, rig)
        })
        .collect()
}

/// Possible persons may be this many margins away from an area: their feet are less exact than
/// those of persons.
const TARGET_MARGINS: f64 = 2.0;

/// The least probability with which something is worth a further look. `docs/lab/results.md` has
/// the accuracy and the cost with other values.
const TARGET_PROBABILITY: f64 = 0.035;

/// The least vote for lying with which something is worth a crop for people on the floor. With .2,
/// photographs get 4 to 5 such crops a frame instead of 1 to 2, and no more people are found.
const FLOOR_TARGET_VOTE: f64 = 0.3;

/// Merges the boxes of the passes so far into possible persons within the frame, highest score
/// first: those that any network knows, or those `on_the_floor`.
pub(super) fn possible_persons(
    passes: &[Pass],
    rig: &CameraRig,
    profile: Profile,
    tuning: &Tuning,
    on_the_floor: bool,
) -> Vec<CropTarget> {
    let calibration = ScoreCalibration::new(tuning, Refinement::Fusion);
    let parameters = RefinementParameters {
        refinement: Refinement::Fusion,
        iou_threshold: 0.5,
        sigma: 0.3,
        score_threshold: calibration.merged(TARGET_PROBABILITY),
        max_detections: 500,
    };
    let (mapped, mut merged) = merged(passes, rig, profile, tuning, &parameters, on_the_floor);
    if on_the_floor {
        merged.retain(|merged| {
            let votes = floor_votes(&members(merged, &mapped), passes);
            votes.is_some_and(|votes| votes.lying > FLOOR_TARGET_VOTE)
        });
    }
    if !rig.geometry.areas.foot_filter.areas.is_empty() {
        merged.retain(|merged| may_count(merged, &mapped, rig));
    }
    let geometry = &rig.geometry;
    let targets = merged.iter().filter_map(|merged| {
        let bbox = merged.bbox.clipped_to(&rig.frame)?;
        let center = nalgebra::Point2::from(bbox.center());
        Some(CropTarget {
            bbox: bbox.corners(),
            score: merged.score,
            up: vertical_in_frame(center, &geometry.lens, &geometry.mount),
        })
    });
    targets.collect()
}

/// Returns the boxes that became a merged one.
fn members<'a>(merged: &MergedDetection, mapped: &[&'a Mapped]) -> Vec<&'a Mapped> {
    let members = merged.members.iter();
    members.map(|&member| mapped[member]).collect()
}

/// Returns true if a merged box may become a person in the margin of an area.
fn may_count(merged: &MergedDetection, mapped: &[&Mapped], rig: &CameraRig) -> bool {
    let members = members(merged, mapped);
    let filter = &rig.geometry.areas.foot_filter;
    let person = person(merged.bbox, merged.score, &members, None, rig);
    person.is_none_or(|person| filter.is_near(person.foot, person.floor, TARGET_MARGINS))
}

/// Merges the boxes of every view: those of persons, and `with_postures` those of people on the
/// floor as well.
fn merged<'a>(
    passes: &'a [Pass],
    rig: &CameraRig,
    profile: Profile,
    tuning: &Tuning,
    parameters: &RefinementParameters,
    with_postures: bool,
) -> (Vec<&'a Mapped>, Vec<MergedDetection>) {
    let is_fusion = parameters.refinement == Refinement::Fusion;
    // Suppression only lowers scores. In fusion, boxes below the threshold still vote.
    let matters = |mapped: &&Mapped| {
        (is_fusion || mapped.candidate.score >= parameters.score_threshold)
            && (with_postures || mapped.posture.is_none())
    };
    let of_passes = passes
        .iter()
        .flat_map(|pass| pass.mapped(profile.back_projection()));
    let mapped: Vec<&Mapped> = of_passes.filter(matters).collect();
    // Suppression compares the detector's scores; fusion weights them.
    let candidates: Vec<Candidate> = if is_fusion {
        let weighted = mapped
            .iter()
            .map(|one| one.weighted(passes, rig, tuning.crop_vote));
        weighted.collect()
    } else {
        mapped.iter().map(|one| one.candidate).collect()
    };
    let merged = refine(&candidates, parameters);
    (mapped, merged)
}

/// Builds a person from the members of a merged box. Returns `None` for a box outside the frame:
/// lens images may be larger than frames.
fn person(
    bbox: BBox<FramePixels>,
    score: f64,
    members: &[&Mapped],
    votes: Option<FloorVotes>,
    rig: &CameraRig,
) -> Option<Person> {
    let geometry = &rig.geometry;
    let bounds = bbox.corners();
    let bbox = bbox.clipped_to(&rig.frame)?;
    let center = nalgebra::Point2::from(bbox.center());
    let up = vertical_in_frame(center, &geometry.lens, &geometry.mount);
    // Upright views determine the proportions, crops the extent.
    let has_exact = members.iter().any(|member| member.is_exact);
    let has_upright = members.iter().any(|member| !member.is_exact);
    let proportioned = members
        .iter()
        .filter(|member| !(has_upright && member.is_exact));
    let outlines = proportioned.map(|member| {
        let weight = member.candidate.score.powi(3) * member.candidate.coordinate_weight;
        // A score of 0 is valid, but the outline needs a weight above 0.
        (weight.max(f64::MIN_POSITIVE), &*member.footprint.outline)
    });
    let averaged = OrientedBox::averaging(up, outlines)?;
    let upright_box = if has_exact {
        averaged.fitted_to(bounds)
    } else {
        averaged
    };
    let mut views: Vec<usize> = members.iter().map(|member| member.candidate.view).collect();
    views.sort_unstable();
    views.dedup();
    let mut person = placed(bbox, score, upright_box, views.len(), votes, rig);
    if person.lies() {
        let mut widths = Vec::new();
        for member in members {
            let weight = member.candidate.score * member.candidate.coordinate_weight;
            widths.extend(member.widths.iter().flatten().map(|width| (weight, *width)));
        }
        person.oriented_box = person.upright_box.tilted_to_widths(&widths);
    }
    Some(person)
}

/// Returns the mean vote for people on the floor, over the views that show the person; `None` if no
/// network told postures.
fn floor_votes(members: &[&Mapped], passes: &[Pass]) -> Option<FloorVotes> {
    passes.iter().find(|pass| pass.tells_postures())?;
    let mut by_view: BTreeMap<usize, FloorVotes> = BTreeMap::new();
    for member in members {
        if let Some(posture) = member.posture {
            let Candidate { view, score, .. } = member.candidate;
            by_view.entry(view).or_default().raise(posture, score);
        }
    }
    let holding = views_holding(passes, &members.first()?.footprint, true);
    Some(FloorVotes::mean_of_best(
        by_view.into_values().collect(),
        holding,
    ))
}

/// Returns the person in a box of the frame, with its place on the floor.
pub(super) fn placed(
    bbox: BBox<FramePixels>,
    score: f64,
    upright_box: OrientedBox,
    views: usize,
    floor_votes: Option<FloorVotes>,
    rig: &CameraRig,
) -> Person {
    let geometry = &rig.geometry;
    let mut person = Person {
        bbox,
        score,
        upright_box,
        oriented_box: upright_box,
        bearing: bearing(nalgebra::Point2::from(bbox.center()), &geometry.lens),
        foot: upright_box.foot(),
        floor: None,
        views,
        height: PersonHeight::new(&upright_box, &geometry.lens, &geometry.mount),
        posture: posture(&upright_box, floor_votes, rig),
        floor_votes,
        zones: None,
    };
    if person.lies() {
        person.foot = upright_box.center;
        person.height = None;
    }
    person.floor = floor_position(person.foot, &geometry.lens, &geometry.mount);
    person.zones = person.zones_of(&geometry.areas.zones);
    person
}

/// Returns the posture that one frame tells, with its probability.
fn posture(person: &OrientedBox, votes: Option<FloorVotes>, rig: &CameraRig) -> (Posture, f64) {
    let geometry = &rig.geometry;
    let camera_m = geometry.mount.height_m();
    let angles = BoxAngles::new(person, &geometry.lens, &geometry.mount);
    let signs = PostureSigns { angles, votes };
    if signs == PostureSigns::default() {
        return (Posture::Unknown, 0.0);
    }
    let mut belief = PostureBelief::new(camera_m.is_some());
    belief.add(&signs, camera_m, f64::INFINITY);
    belief.posture()
}
