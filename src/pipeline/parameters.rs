//! Request parameters: the same names and rules in multipart fields, query strings and
//! command-line flags, checked once.

use std::time::Duration;

use jiff::Timestamp;

use super::{
    ParameterError, Priority, Profile,
    parameter_error::{shown, whole_number},
};
use crate::{
    calibration::CalibrationId,
    detection::{Refinement, RefinementParameters},
};

/// Longest camera name.
const MAX_CAMERA_CHARS: usize = 128;
/// Most persons a report may hold, and the default.
const MAX_DETECTIONS: u64 = 10_000;
const DEFAULT_MAX_DETECTIONS: usize = 1_000;
/// Ten minutes.
const MAX_TIMEOUT_MILLIS: u64 = 600_000;
/// N_t of hard NMS and linear Soft-NMS (Seidel et al., section IV: "IoU > 0.5").
const DEFAULT_SUPPRESSION_IOU: f64 = 0.5;
/// Boxes that overlap at least this much are fused.
const DEFAULT_FUSION_IOU: f64 = 0.5;
/// σ of Gaussian Soft-NMS; the paper does not state its best value.
const DEFAULT_SIGMA: f64 = 0.3;

/// The checked parameters of one detection request.
#[derive(Debug, Clone, PartialEq)]
pub struct DetectParameters {
    /// Which calibration to use; without one the lens circle is found in the frame.
    pub calibration: Option<CalibrationId>,
    /// Under which name results are kept.
    pub camera: Option<String>,
    /// The profile.
    pub profile: Profile,
    /// Which model must answer; any by default.
    pub model: Option<String>,
    /// How overlapping boxes become persons.
    pub refinement: RefinementParameters,
    /// When the frame was taken.
    pub captured_at: Option<Timestamp>,
    /// Whether views in which nothing has moved since the camera's last frame need not be looked at
    /// again.
    pub motion: bool,
    /// Whether what is found in the views is remembered, and used if it already is.
    pub remember: bool,
    /// Its turn among the frames that wait.
    pub priority: Priority,
    /// How long the report is of use, from the arrival of the request.
    pub timeout: Option<Duration>,
}

impl DetectParameters {
    /// The names every caller may use.
    pub const NAMES: [&'static str; 14] = [
        "calibration",
        "camera",
        "profile",
        "refine",
        "model",
        "score_threshold",
        "iou_threshold",
        "sigma",
        "max_detections",
        "captured_at",
        "motion",
        "remember",
        "priority",
        "timeout_millis",
    ];

    /// Checks `(name, value)` pairs. `default_score_threshold` is C_t when the caller gives none.
    ///
    /// # Errors
    /// [`ParameterError`] for an unknown or repeated name and for a value out of range.
    pub fn parse<'a>(
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
        default_score_threshold: f64,
    ) -> Result<Self, ParameterError> {
        let mut given: [Option<&str>; Self::NAMES.len()] = [None; Self::NAMES.len()];
        for (name, value) in pairs {
            let Some(index) = Self::NAMES.iter().position(|known| *known == name) else {
                let known = Self::NAMES.join(", ");
                let problem = format!("there is no such parameter; the parameters are {known}");
                return Err(ParameterError::unknown(name, problem));
            };
            if given[index].replace(value).is_some() {
                return Err(ParameterError::repeated(name));
            }
        }
        let [
            calibration,
            camera,
            profile,
            refine,
            model,
            score_threshold,
            iou_threshold,
            sigma,
            max_detections,
            captured_at,
            motion,
            remember,
            priority,
            timeout_millis,
        ] = given;
        let profile = profile.map_or(Ok(Profile::default()), parse_profile)?;
        let refinement = refine.map_or(Ok(profile.default_refinement()), parse_refinement)?;
        let default_iou_threshold = match refinement {
            Refinement::Fusion => DEFAULT_FUSION_IOU,
            _ => DEFAULT_SUPPRESSION_IOU,
        };
        let motion = motion.map_or(Ok(false), |value| parse_switch("motion", value))?;
        if motion && camera.is_none() && calibration.is_none() {
            let rule = "name the camera, or its calibration: without a name there is no last \
                        frame to compare with";
            return Err(ParameterError::bad_value("motion", rule.to_owned()));
        }
        Ok(Self {
            calibration: calibration.map(parse_calibration).transpose()?,
            camera: camera.map(parse_camera).transpose()?,
            profile,
            model: model.map(ToOwned::to_owned),
            refinement: RefinementParameters {
                refinement,
                score_threshold: unit_interval(
                    "score_threshold",
                    score_threshold,
                    default_score_threshold,
                )?,
                iou_threshold: unit_interval(
                    "iou_threshold",
                    iou_threshold,
                    default_iou_threshold,
                )?,
                sigma: sigma.map_or(Ok(DEFAULT_SIGMA), parse_sigma)?,
                max_detections: max_detections
                    .map_or(Ok(DEFAULT_MAX_DETECTIONS), parse_max_detections)?,
            },
            captured_at: captured_at.map(parse_timestamp).transpose()?,
            motion,
            remember: remember.map_or(Ok(false), |value| parse_switch("remember", value))?,
            priority: priority.map_or(Ok(Priority::default()), parse_priority)?,
            timeout: timeout_millis.map(parse_timeout).transpose()?,
        })
    }
}

impl DetectParameters {
    /// The name of the camera, if the request gave it one.
    #[must_use]
    pub fn camera_name(&self) -> Option<&str> {
        let calibration = self.calibration.as_ref().map(CalibrationId::as_str);
        self.camera.as_deref().or(calibration)
    }
}

/// The profile of that name, as the parameter `profile` names it.
///
/// # Errors
/// [`ParameterError`] when there is none.
pub fn parse_profile(value: &str) -> Result<Profile, ParameterError> {
    Profile::from_name(value).ok_or_else(|| {
        let known = Profile::ALL.map(Profile::name).join(", ");
        ParameterError::is_not("profile", value, &format!("a profile; use one of {known}"))
    })
}

fn parse_refinement(value: &str) -> Result<Refinement, ParameterError> {
    value.parse().map_err(|_| {
        let known = Refinement::ALL
            .map(|refinement| refinement.to_string())
            .join(", ");
        ParameterError::is_not(
            "refine",
            value,
            &format!("a refinement; use one of {known}"),
        )
    })
}

fn parse_calibration(value: &str) -> Result<CalibrationId, ParameterError> {
    value
        .parse()
        .map_err(|error| ParameterError::bad_value("calibration", format!("{error}")))
}

fn parse_camera(value: &str) -> Result<String, ParameterError> {
    let acceptable = !value.is_empty()
        && value.chars().count() <= MAX_CAMERA_CHARS
        && !value.chars().any(char::is_control);
    if !acceptable {
        let rule = format!("use 1 to {MAX_CAMERA_CHARS} characters without control characters");
        return Err(ParameterError::bad_value(
            "camera",
            format!("the name cannot be used; {rule}"),
        ));
    }
    Ok(value.to_owned())
}

fn number(name: &str, value: &str) -> Result<f64, ParameterError> {
    value
        .parse()
        .map_err(|_| ParameterError::is_not(name, value, "a number"))
}

fn unit_interval(name: &str, value: Option<&str>, default: f64) -> Result<f64, ParameterError> {
    let Some(value) = value else {
        return Ok(default);
    };
    let parsed = number(name, value)?;
    if !(0.0..=1.0).contains(&parsed) {
        return Err(ParameterError::bad_value(
            name,
            format!("{} is outside 0 to 1", shown(value)),
        ));
    }
    Ok(parsed)
}

fn parse_sigma(value: &str) -> Result<f64, ParameterError> {
    let sigma = number("sigma", value)?;
    if !(sigma.is_finite() && sigma > 0.0) {
        return Err(ParameterError::bad_value(
            "sigma",
            format!("{} is not a finite number above 0", shown(value)),
        ));
    }
    Ok(sigma)
}

fn parse_max_detections(value: &str) -> Result<usize, ParameterError> {
    let count = whole_number("max_detections", value, 1..=MAX_DETECTIONS)?;
    Ok(usize::try_from(count).unwrap_or(usize::MAX))
}

fn parse_priority(value: &str) -> Result<Priority, ParameterError> {
    let level = whole_number("priority", value, Priority::FIRST..=Priority::LAST)?;
    Ok(Priority::new(level).unwrap_or_default())
}

fn parse_switch(name: &str, value: &str) -> Result<bool, ParameterError> {
    value
        .parse()
        .map_err(|_| ParameterError::is_not(name, value, "true or false"))
}

fn parse_timeout(value: &str) -> Result<Duration, ParameterError> {
    whole_number("timeout_millis", value, 1..=MAX_TIMEOUT_MILLIS).map(Duration::from_millis)
}

fn parse_timestamp(value: &str) -> Result<Timestamp, ParameterError> {
    value.parse().map_err(|_| {
        let rule = "an RFC 3339 time with an offset, such as 2026-11-21T09:30:00Z";
        ParameterError::is_not("captured_at", value, rule)
    })
}

#[cfg(test)]
mod tests;
