//! The parameters of a detection: the table of their specifications, and the checked values of a
//! request. A new parameter needs a row in the table, a field of [`DetectParameters`] and a line in
//! its parser.

use std::time::Duration;

use jiff::Timestamp;
use lookdown_calibration::CalibrationId;
use lookdown_common::text::MAX_CAMERA_CHARS;
use strum::VariantNames;

use super::{
    DefaultSource, DefaultUsed, DetectDefaults, GivenParameters, Interface, ParameterDefault,
    ParameterError, ParameterKind, ParameterSpec, Priority, Profile,
};
use crate::{
    detection::{Refinement, RefinementParameters},
    fairness::PriorityLevel,
};

/// The interfaces of every protocol. `lookdown detect` has its own `--calibration FILE|ID` for the
/// first row.
const REQUESTS: &[Interface] = &[Interface::Http, Interface::FrameModel];
const EVERY_DETECTION: &[Interface] = &[
    Interface::Http,
    Interface::FrameModel,
    Interface::CommandLine,
];
/// Those of the parameters whose defaults can be set for a camera or a server.
const DETECTION_WITH_DEFAULTS: &[Interface] = &[
    Interface::Http,
    Interface::FrameModel,
    Interface::CommandLine,
    Interface::Defaults,
];
const REQUESTS_WITH_DEFAULTS: &[Interface] =
    &[Interface::Http, Interface::FrameModel, Interface::Defaults];
const EVERY_REQUEST: &[Interface] = &[Interface::Http, Interface::FrameModel];

parameter_table! {
    /// The parameters of a detection.
    pub(super) const TABLE;

    CALIBRATION = ParameterSpec {
        name: "calibration",
        kind: ParameterKind::Pattern {
            regex: CalibrationId::PATTERN,
            rule: CalibrationId::RULE,
        },
        default: ParameterDefault::Described("an ideal 180° lens on the circle found in the frame"),
        help: "ID of the calibration of the camera.",
        example: Some("lobby"),
        interfaces: REQUESTS,
    };
    CAMERA = ParameterSpec {
        name: "camera",
        kind: ParameterKind::Name {
            max_chars: MAX_CAMERA_CHARS,
        },
        default: ParameterDefault::Described("the ID of the calibration"),
        help: "Name of the camera, under which its results are kept.",
        example: Some("lobby-north"),
        interfaces: EVERY_DETECTION,
    };
    PROFILE = ParameterSpec {
        name: "profile",
        kind: ParameterKind::Choice(Profile::VARIANTS),
        default: ParameterDefault::Value("balanced"),
        help: "Trade-off between accuracy and cost. `paper` is the published method with its 128 views, \
               `direct` runs the detector on the frame itself.",
        example: None,
        interfaces: DETECTION_WITH_DEFAULTS,
    };
    REFINE = ParameterSpec {
        name: "refine",
        kind: ParameterKind::Choice(Refinement::VARIANTS),
        default: ParameterDefault::Described(
            "`fusion`; with the profile `paper` `soft_nms_gaussian`, with `direct` `nms`",
        ),
        help: "Method that merges overlapping boxes into persons.",
        example: None,
        interfaces: DETECTION_WITH_DEFAULTS,
    };
    MODEL = ParameterSpec {
        name: "model",
        kind: ParameterKind::Text,
        default: ParameterDefault::Described("the model of the profile"),
        help: "Name of the person detector.",
        example: Some("nanodet_g_views_416"),
        interfaces: DETECTION_WITH_DEFAULTS,
    };
    SCORE_THRESHOLD = ParameterSpec {
        name: "score_threshold",
        kind: ParameterKind::Fraction,
        default: ParameterDefault::Value("0.3"),
        help: "Minimum score of a person (`C_t`), with fusion a probability. Persons with a lower score are left out.",
        example: None,
        interfaces: DETECTION_WITH_DEFAULTS,
    };
    // Seidel et al. state "IoU > 0.5" for NMS in section IV; the boxes of fusion overlap as much.
    IOU_THRESHOLD = ParameterSpec {
        name: "iou_threshold",
        kind: ParameterKind::Fraction,
        default: ParameterDefault::Value("0.5"),
        help: "Minimum IoU of boxes of the same person (`N_t`).",
        example: None,
        interfaces: DETECTION_WITH_DEFAULTS,
    };
    // The paper does not state the value that it used.
    SIGMA = ParameterSpec {
        name: "sigma",
        kind: ParameterKind::Positive,
        default: ParameterDefault::Value("0.3"),
        help: "Width σ of `soft_nms_gaussian`.",
        example: None,
        interfaces: DETECTION_WITH_DEFAULTS,
    };
    MAX_DETECTIONS = ParameterSpec {
        name: "max_detections",
        kind: ParameterKind::Whole { min: 1, max: 10_000 },
        default: ParameterDefault::Value("1000"),
        help: "Maximum number of persons in the report, best first.",
        example: None,
        interfaces: DETECTION_WITH_DEFAULTS,
    };
    CAPTURED_AT = ParameterSpec {
        name: "captured_at",
        kind: ParameterKind::Time,
        default: ParameterDefault::None,
        help: "Time at which the frame was captured, RFC 3339.",
        example: Some("2026-11-21T09:30:00Z"),
        interfaces: EVERY_DETECTION,
    };
    MOTION = ParameterSpec {
        name: "motion",
        kind: ParameterKind::Switch,
        default: ParameterDefault::Value("false"),
        help: "Skips views without motion since the last frame of this camera that the server \
               processed, at most 10 s ago. The report counts them as unchanged. Needs `camera` or \
               `calibration`; up to 256 cameras are cached.",
        example: None,
        interfaces: REQUESTS_WITH_DEFAULTS,
    };
    FOLLOW = ParameterSpec {
        name: "follow",
        kind: ParameterKind::Switch,
        default: ParameterDefault::Value("false"),
        help: "Searches the whole frame about once a second, when something moves where no person was, \
               and when a crop loses a person. In the frames between, the detector sees only crops at \
               the places where the persons of this camera are expected, and those without motion stay \
               as they were. Crops are wider the more time has passed. After 0.9 s, or 1.6 s where motion \
               is known, people may have left even these, and the frame is searched. With `motion`, a \
               still frame is not searched for 10 s once all scores are settled. Needs `camera` or \
               `calibration`; up to 256 cameras are followed.",
        example: None,
        interfaces: REQUESTS_WITH_DEFAULTS,
    };
    FLOOR = ParameterSpec {
        name: "floor",
        kind: ParameterKind::Switch,
        default: ParameterDefault::Described("`false`; with `counts.floor_alert` `true`"),
        help: "Looks for people on the floor as well: people who lie, crouch, kneel, crawl or sit \
               there. The views have another network then, which finds upright people a little less \
               well in photographs, and up to 5 crops show it who may be there.",
        example: None,
        interfaces: DETECTION_WITH_DEFAULTS,
    };
    STORE = ParameterSpec {
        name: "store",
        kind: ParameterKind::Switch,
        default: ParameterDefault::Described("`true` with `camera` or `calibration`, else `false`"),
        help: "Stores the report under the name of its camera, for `/results`, MQTT and the metrics \
               of cameras. Without `camera` and `calibration` that name is `assumed`, which all such \
               frames share.",
        example: None,
        interfaces: REQUESTS_WITH_DEFAULTS,
    };
    PRIORITY = ParameterSpec {
        name: "priority",
        kind: ParameterKind::Whole {
            min: PriorityLevel::HIGHEST,
            max: PriorityLevel::LOWEST,
        },
        default: ParameterDefault::Value(PriorityLevel::DEFAULT),
        help: "Priority among queued frames: 1 to 3 are high, 4 to 6 normal, 7 to 9 low. Clients of \
               the same priority take turns. A key may limit the priority (`highest_priority`).",
        example: None,
        interfaces: EVERY_REQUEST,
    };
    TIMEOUT_MILLIS = ParameterSpec {
        name: "timeout_millis",
        kind: ParameterKind::Whole { min: 1, max: 600_000 },
        default: ParameterDefault::Described("`server.request_timeout_millis`"),
        help: "Milliseconds from the arrival of the request after which the frame is dropped and \
               answered with 504. The timeout of the server applies as well.",
        example: Some("2000"),
        interfaces: EVERY_REQUEST,
    };
}

/// The checked parameters of one detection request.
#[derive(Debug, Clone, PartialEq)]
#[expect(
    clippy::struct_excessive_bools,
    reason = "each is a parameter of requests"
)]
pub struct DetectParameters {
    /// The calibration. Without one, the lens circle is detected in the frame.
    pub calibration: Option<CalibrationId>,
    /// The camera name under which results are stored.
    pub camera: Option<String>,
    /// The profile.
    pub profile: Profile,
    /// The required model; any model by default.
    pub model: Option<String>,
    /// The merge of overlapping boxes into persons.
    pub refinement: RefinementParameters,
    /// The time at which the frame was captured.
    pub captured_at: Option<Timestamp>,
    /// Skips views without motion since the last frame of the camera.
    pub motion: bool,
    /// Follows the persons of the camera between searches of the whole frame.
    pub follow: bool,
    /// Looks for people on the floor as well, with another network for the views.
    pub floor: bool,
    /// Stores the report under the name of its camera.
    pub store: bool,
    /// The priority among queued frames.
    pub priority: Priority,
    /// The timeout, from the arrival of the request.
    pub timeout: Option<Duration>,
    /// The values that were defaults of the camera or the server.
    pub defaults: Vec<DefaultUsed>,
}

impl DetectParameters {
    /// The specifications, in the order in which they are listed to users.
    pub const TABLE: &'static [ParameterSpec] = TABLE;
    /// The parameter of the calibration.
    pub const CALIBRATION: &'static str = CALIBRATION.name;
    /// The parameter of the camera's name.
    pub const CAMERA: &'static str = CAMERA.name;
    /// The parameter of the model.
    pub const MODEL: &'static str = MODEL.name;
    /// The parameter of people on the floor.
    pub const FLOOR: &'static str = FLOOR.name;
    /// The parameter of the least score.
    pub const SCORE_THRESHOLD: &'static str = SCORE_THRESHOLD.name;

    /// Checks `(name, value)` pairs.
    ///
    /// # Errors
    /// [`ParameterError`] for an unknown or repeated name and for a value out of range.
    pub fn parse<'a>(
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ParameterError> {
        Self::parse_with(pairs, &[])
    }

    /// Checks `(name, value)` pairs of a request, and completes them with defaults, those with
    /// precedence first.
    ///
    /// # Errors
    /// [`ParameterError`] for an unknown or repeated name and for a value out of range.
    pub fn parse_with<'a>(
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
        defaults: &[(DefaultSource, &'a DetectDefaults)],
    ) -> Result<Self, ParameterError> {
        let mut given = GivenParameters::read(TABLE, pairs)?.with_defaults(defaults);
        let is_named = given.text(&CAMERA).or(given.text(&CALIBRATION)).is_some();
        if !is_named {
            given.drop_default(&MOTION);
            given.drop_default(&FOLLOW);
        }
        let profile: Profile = given.value(&PROFILE)?;
        let refinement = given.optional(&REFINE)?;
        let max_detections: u32 = given.value(&MAX_DETECTIONS)?;
        let timeout = given.optional(&TIMEOUT_MILLIS)?;
        let parameters = Self {
            calibration: given.optional(&CALIBRATION)?,
            camera: given.optional(&CAMERA)?,
            profile,
            model: given.optional(&MODEL)?,
            refinement: RefinementParameters {
                refinement: refinement.unwrap_or(profile.default_refinement()),
                score_threshold: given.value(&SCORE_THRESHOLD)?,
                iou_threshold: given.value(&IOU_THRESHOLD)?,
                sigma: given.value(&SIGMA)?,
                max_detections: max_detections as usize,
            },
            captured_at: given.optional(&CAPTURED_AT)?,
            motion: given.value(&MOTION)?,
            follow: given.value(&FOLLOW)?,
            floor: given.optional(&FLOOR)?.unwrap_or(false),
            store: given.optional(&STORE)?.unwrap_or(is_named),
            priority: Priority::from_level(given.value(&PRIORITY)?),
            timeout: timeout.map(Duration::from_millis),
            defaults: given.defaults_used(),
        };
        let uses = [(parameters.motion, MOTION), (parameters.follow, FOLLOW)];
        let unnamed = uses.iter().find(|(is_used, _)| *is_used && !is_named);
        if let Some((_, parameter)) = unnamed {
            let rule = "name the camera, or its calibration: without a name there is no last \
                        frame to compare with";
            return Err(ParameterError::bad_value(parameter.name, rule.to_owned()));
        }
        Ok(parameters)
    }

    /// Returns the name of the camera, if the request gave it one.
    pub fn camera_name(&self) -> Option<&str> {
        let calibration = self.calibration.as_ref().map(CalibrationId::as_str);
        self.camera.as_deref().or(calibration)
    }

    /// Returns the name of the camera whose views without motion need no inference.
    pub(crate) fn motion_camera(&self) -> Option<&str> {
        self.camera_name().filter(|_| self.motion)
    }
}

/// Parses a value of the parameter `profile`.
///
/// # Errors
/// [`ParameterError`] for an unknown profile.
pub fn parse_profile(value: &str) -> Result<Profile, ParameterError> {
    PROFILE.parse(value)
}

/// Longest text of a value: reports repeat it.
const MAX_CHARS: usize = 128;

impl DetectDefaults {
    /// Checks `(name, value)` pairs.
    ///
    /// # Errors
    /// [`ParameterError`] for a repeated name, a name of a parameter without such defaults, and a
    /// value out of range.
    pub fn parse<'a>(
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ParameterError> {
        let pairs: Vec<_> = pairs.into_iter().collect();
        let mut values = Vec::with_capacity(pairs.len());
        for (name, value) in &pairs {
            let Some(spec) = Self::offered().find(|spec| spec.name == *name) else {
                let known: Vec<_> = Self::offered().map(|spec| spec.name).collect();
                let known = known.join(", ");
                let problem = format!("no default can be set for it; use one of {known}");
                return Err(ParameterError::unknown(name, problem));
            };
            if value.chars().count() > MAX_CHARS {
                let problem = format!("it is longer than {MAX_CHARS} characters");
                return Err(ParameterError::bad_value(name, problem));
            }
            values.push((spec.name, (*value).to_owned()));
        }
        // Motion detection needs a camera, which the request names.
        let camera = [(DetectParameters::CAMERA, "camera")];
        DetectParameters::parse(pairs.into_iter().chain(camera))?;
        Ok(Self::new(values))
    }

    /// Returns the default of the parameter `follow` for a frame of a camera.
    pub fn follow(&self) -> bool {
        self.of_camera(|parameters| parameters.follow)
    }

    /// Returns the default of the parameter `floor`.
    pub fn floor(&self) -> bool {
        self.of_camera(|parameters| parameters.floor)
    }

    fn of_camera(&self, switch: impl FnOnce(DetectParameters) -> bool) -> bool {
        let camera = [(DetectParameters::CAMERA, "camera")];
        let parameters = DetectParameters::parse_with(camera, &[(DefaultSource::Server, self)]);
        parameters.is_ok_and(switch)
    }

    /// Lists the parameters for which defaults can be set.
    pub fn offered() -> impl Iterator<Item = &'static ParameterSpec> {
        let table = DetectParameters::TABLE.iter();
        table.filter(|spec| spec.is_offered_by(Interface::Defaults))
    }
}

#[cfg(test)]
mod tests;
