use super::*;
use crate::parameters::ParameterFault;

fn parse(pairs: &[(&str, &str)]) -> Result<DetectParameters, ParameterError> {
    DetectParameters::parse(pairs.iter().copied())
}

#[test]
fn defaults_are_those_of_the_contract() {
    let parameters = parse(&[]).unwrap();
    assert_eq!(parameters.profile, Profile::Balanced);
    assert_eq!(parameters.refinement.refinement, Refinement::Fusion);
    assert_eq!(parameters.refinement.score_threshold, 0.3);
    assert_eq!(parameters.calibration, None);
    assert_eq!(parameters.profile, Profile::default());
    assert_eq!(parameters.priority, Priority::default());

    let paper = parse(&[("profile", "paper")]).unwrap();
    assert_eq!(paper.refinement.refinement, Refinement::SoftNmsGaussian);
    assert_eq!(paper.refinement.iou_threshold, 0.5);
}

#[test]
fn every_parameter_is_parsed() {
    let parameters = parse(&[
        ("calibration", "lobby"),
        ("camera", "Lobby, north"),
        ("profile", "quality"),
        ("refine", "soft_nms_linear"),
        ("model", "ssdlite_mobilenet_v2"),
        ("score_threshold", "0"),
        ("iou_threshold", "1"),
        ("sigma", "0.7"),
        ("max_detections", "5"),
        ("captured_at", "2026-11-21T09:30:00+01:00"),
        ("motion", "True"),
        ("follow", "TRUE"),
        ("priority", "2"),
        ("timeout_millis", "1500"),
    ])
    .unwrap();
    assert!(parameters.motion && parameters.follow);
    assert_eq!(parameters.priority, Priority::High);
    assert_eq!(parameters.timeout, Some(Duration::from_millis(1500)));
    assert_eq!(parameters.calibration.unwrap().as_str(), "lobby");
    assert_eq!(parameters.camera.unwrap(), "Lobby, north");
    assert_eq!(parameters.refinement.refinement, Refinement::SoftNmsLinear);
    assert_eq!(parameters.refinement.score_threshold, 0.0);
    assert_eq!(parameters.refinement.iou_threshold, 1.0);
    assert_eq!(parameters.refinement.sigma, 0.7);
    assert_eq!(parameters.refinement.max_detections, 5);
    assert_eq!(
        parameters.captured_at.unwrap().to_string(),
        "2026-11-21T08:30:00Z"
    );
}

#[test]
fn bad_values_are_refused_with_name_value_and_rule() {
    for (name, value, expected) in [
        (
            "score_threshold",
            "1.5",
            "score_threshold: \"1.5\" is not a number from 0 to 1",
        ),
        (
            "score_threshold",
            "NaN",
            "score_threshold: \"NaN\" is not a number from 0 to 1",
        ),
        (
            "score_threshold",
            "high",
            "score_threshold: \"high\" is not a number from 0 to 1",
        ),
        (
            "iou_threshold",
            "-0.1",
            "iou_threshold: \"-0.1\" is not a number from 0 to 1",
        ),
        ("sigma", "0", "sigma: \"0\" is not a finite number above 0"),
        (
            "sigma",
            "inf",
            "sigma: \"inf\" is not a finite number above 0",
        ),
        (
            "max_detections",
            "0",
            "max_detections: \"0\" is not a whole number from 1 to 10000",
        ),
        ("motion", "yes", "motion: \"yes\" is not true or false"),
        (
            "motion",
            "true",
            "motion: name the camera, or its calibration: without a name there is no last frame to \
             compare with",
        ),
        (
            "priority",
            "10",
            "priority: \"10\" is not a whole number from 1 to 9",
        ),
        (
            "timeout_millis",
            "0",
            "timeout_millis: \"0\" is not a whole number from 1 to 600000",
        ),
        (
            "profile",
            "best",
            "profile: \"best\" is not one of paper, fast, balanced, quality, direct",
        ),
        (
            "refine",
            "soft",
            "refine: \"soft\" is not one of nms, soft_nms_linear, soft_nms_gaussian, fusion",
        ),
        (
            "captured_at",
            "now",
            "captured_at: \"now\" is not an RFC 3339 time with an offset, such as 2026-11-21T09:30:00Z",
        ),
        (
            "camera",
            "",
            "camera: \"\" is not a name of 1 to 128 characters without control characters",
        ),
    ] {
        let error = parse(&[(name, value)]).unwrap_err();
        assert_eq!(error.to_string(), expected);
        assert_eq!(error.fault, ParameterFault::BadValue);
    }
    assert!(
        parse(&[("calibration", "../x")])
            .unwrap_err()
            .to_string()
            .starts_with("calibration: \"../x\" is not a calibration ID")
    );
}

#[test]
fn unknown_and_repeated_names_are_refused() {
    let unknown = parse(&[("threshold", "0.5")]).unwrap_err();
    assert!(unknown.to_string().starts_with(
        "threshold: there is no such parameter; the parameters are calibration, camera"
    ));
    assert_eq!(unknown.fault, ParameterFault::UnknownName);
    let repeated = parse(&[("sigma", "0.5"), ("sigma", "0.6")]).unwrap_err();
    assert_eq!(
        repeated.to_string(),
        "sigma: it is given twice: give it once"
    );
    assert_eq!(repeated.fault, ParameterFault::Repeated);
}

#[test]
fn long_names_and_values_are_truncated_in_errors() {
    let endless = "x".repeat(100_000);
    assert!(parse(&[(&endless, "1")]).unwrap_err().to_string().len() < 400);
    assert!(parse(&[("sigma", &endless)]).unwrap_err().to_string().len() < 400);
}

#[test]
fn defaults_of_the_table_are_accepted_values() {
    for spec in DetectParameters::TABLE {
        if let ParameterDefault::Value(default) = spec.default {
            let accepted: Result<String, _> = spec.parse(default);
            assert!(accepted.is_ok(), "{}: {default}", spec.name);
        }
        assert!(spec.help.ends_with('.'), "{}", spec.name);
    }
}

#[test]
fn nine_priority_levels_map_to_three_priorities() {
    let priorities = (1..=9).map(|level: u32| {
        let level = level.to_string();
        parse(&[("priority", &level)]).unwrap().priority
    });
    let expected = [Priority::High, Priority::Normal, Priority::Low].map(|priority| [priority; 3]);
    assert_eq!(priorities.collect::<Vec<_>>(), expected.concat());
}

fn defaults(pairs: &[(&str, &str)]) -> DetectDefaults {
    DetectDefaults::parse(pairs.iter().copied()).unwrap()
}

fn parse_with_server(pairs: &[(&str, &str)], camera: &DetectDefaults) -> DetectParameters {
    let server = defaults(&[("profile", "fast"), ("score_threshold", "0.6")]);
    let layers = [
        (DefaultSource::Calibration, camera),
        (DefaultSource::Server, &server),
    ];
    DetectParameters::parse_with(pairs.iter().copied(), &layers).unwrap()
}

#[test]
fn request_precedes_calibration_and_calibration_the_server() {
    let camera = defaults(&[("score_threshold", "0.5"), ("motion", "true")]);
    let used = |parameters: &DetectParameters| -> Vec<_> {
        let defaults = parameters.defaults.iter();
        defaults
            .map(|used| (used.name, used.value.clone(), used.source.name()))
            .collect()
    };
    let parameters = parse_with_server(&[("calibration", "lobby")], &camera);
    assert_eq!(parameters.refinement.score_threshold, 0.5);
    assert_eq!(parameters.profile.name(), "fast");
    assert!(parameters.motion);
    assert_eq!(
        used(&parameters),
        [
            ("score_threshold", "0.5".to_owned(), "calibration"),
            ("motion", "true".to_owned(), "calibration"),
            ("profile", "fast".to_owned(), "server"),
        ]
    );
    let request = [("camera", "hall"), ("score_threshold", "0.7")];
    let parameters = parse_with_server(&request, &camera);
    assert_eq!(parameters.refinement.score_threshold, 0.7);
    assert_eq!(used(&parameters).len(), 2);
}

#[test]
fn default_motion_detection_skips_unnamed_cameras() {
    let parameters = parse_with_server(&[], &defaults(&[("motion", "true")]));
    assert!(!parameters.motion);
    assert!(parameters.defaults.iter().all(|used| used.name != "motion"));
}

#[test]
fn invalid_defaults_are_refused_by_name() {
    for (name, value) in [
        ("profile", "best"),
        ("motion", "yes"),
        ("camera", "hall"),
        ("captured_at", "2026-11-21T09:30:00Z"),
        ("threshold", "1"),
    ] {
        let error = DetectDefaults::parse([(name, value)]).unwrap_err();
        assert_eq!(error.name, name);
    }
}
