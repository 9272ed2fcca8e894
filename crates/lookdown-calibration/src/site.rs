//! The place of a camera on a site, checked.

use lookdown_lens::geometry::SitePlacement;

use crate::{FormatError, id::check_name, native::NativeMount};

/// Farthest coordinate of a site, meters.
const MAX_POSITION_M: f64 = 10_000.0;

/// Checks the fields of the mount that place a camera on a site.
pub(super) fn site_placement(mount: &NativeMount) -> Result<Option<SitePlacement>, FormatError> {
    let Some(site) = &mount.site else {
        let lone = [
            ("position_m", mount.position_m.is_some()),
            ("yaw_deg", mount.yaw_deg.is_some()),
        ];
        return match lone.iter().find(|(_, is_given)| *is_given) {
            Some((field, _)) => Err(FormatError::invalid(
                format!("mount.{field}"),
                "it needs the name of a site: give mount.site, or leave it out",
            )),
            None => Ok(None),
        };
    };
    check_name("mount.site", site)?;
    if mount.height_m.is_none() {
        let problem = "a site needs positions on the floor: give mount.height_m as well";
        return Err(FormatError::invalid("mount.site", problem));
    }
    let Some(position_m) = mount.position_m else {
        let problem = "it is missing: give the floor point below the camera in meters of the site, \
                       such as [4.0, 2.5]";
        return Err(FormatError::invalid("mount.position_m", problem));
    };
    if !position_m.iter().all(|value| value.abs() <= MAX_POSITION_M) {
        let [x, y] = position_m;
        let problem = format!(
            "it is [{x}, {y}]: give numbers from -{MAX_POSITION_M} to {MAX_POSITION_M} meters"
        );
        return Err(FormatError::invalid("mount.position_m", problem));
    }
    let yaw_deg = mount.yaw_deg.unwrap_or_default();
    let is_angle = yaw_deg.abs() <= 360.0;
    if !is_angle {
        let problem = format!("it is {yaw_deg}: give degrees from -360 to 360");
        return Err(FormatError::invalid("mount.yaw_deg", problem));
    }
    Ok(Some(SitePlacement {
        site: site.clone(),
        position_m,
        yaw_deg,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mount(fields: &str) -> NativeMount {
        serde_json::from_str(&format!(r#"{{"world_up": [0, 0, -1]{fields}}}"#)).unwrap()
    }

    #[test]
    fn a_site_has_a_position_and_a_yaw_that_may_be_absent() {
        assert_eq!(site_placement(&mount("")).unwrap(), None);
        let given = r#", "height_m": 3, "site": "hall", "position_m": [4, 2.5]"#;
        let placement = site_placement(&mount(given)).unwrap().unwrap();
        assert_eq!(
            (placement.site.as_str(), placement.position_m),
            ("hall", [4.0, 2.5])
        );
        assert_eq!(placement.yaw_deg, 0.0);
    }

    #[test]
    fn invalid_sites_are_refused_with_field_and_remedy() {
        for (fields, expected) in [
            (
                r#", "yaw_deg": 90"#,
                "mount.yaw_deg: it needs the name of a site: give mount.site, or leave it out",
            ),
            (
                r#", "height_m": 3, "site": "Hall", "position_m": [0, 0]"#,
                "mount.site: it is \"Hall\": use 1 to 64 of a-z",
            ),
            (
                r#", "site": "hall", "position_m": [0, 0]"#,
                "mount.site: a site needs positions on the floor: give mount.height_m as well",
            ),
            (
                r#", "height_m": 3, "site": "hall""#,
                "mount.position_m: it is missing: give the floor point",
            ),
            (
                r#", "height_m": 3, "site": "hall", "position_m": [0, 1e6]"#,
                "mount.position_m: it is [0, 1000000]",
            ),
            (
                r#", "height_m": 3, "site": "hall", "position_m": [0, 0], "yaw_deg": 400"#,
                "mount.yaw_deg: it is 400: give degrees",
            ),
        ] {
            let refusal = site_placement(&mount(fields)).unwrap_err().to_string();
            assert!(refusal.starts_with(expected), "{refusal}");
        }
    }
}
