//! Content negotiation with the header `Accept` (RFC 9110, section 12.5.1).

use axum::http::{HeaderMap, header::ACCEPT};

/// Full weight, in thousandths: weights have three decimals at most.
const FULL_WEIGHT: u16 = 1000;

/// The media ranges of a request.
pub(in crate::api) struct Accepted {
    ranges: Vec<MediaRange>,
}

/// A media range `type/subtype` with its weight; either part may be `*`. Parameters are ignored: no
/// offered media type has any.
struct MediaRange {
    main: String,
    sub: String,
    /// 0 to [`FULL_WEIGHT`]; 0 excludes the range.
    weight: u16,
}

impl Accepted {
    /// Parses the headers and ignores invalid parts. Without a valid range, everything is accepted,
    /// as without the header.
    pub(in crate::api) fn from_headers(headers: &HeaderMap) -> Self {
        let values = headers.get_all(ACCEPT).iter();
        let texts = values.filter_map(|value| value.to_str().ok());
        let ranges: Vec<_> = texts
            .flat_map(|text| text.split(','))
            .filter_map(MediaRange::parse)
            .collect();
        if ranges.is_empty() {
            return Self {
                ranges: MediaRange::parse("*/*").into_iter().collect(),
            };
        }
        Self { ranges }
    }

    /// Returns the offer with the largest weight. Among equal offers, a type named exactly wins,
    /// then the first one. `None` if no offer is acceptable.
    pub(in crate::api) fn best_of<T: Copy>(&self, offers: &[(T, &str)]) -> Option<T> {
        let wanted = offers.iter().rev().filter_map(|(offer, media_type)| {
            let (precision, weight) = self.weight_of(media_type)?;
            (weight > 0).then_some((weight, precision, *offer))
        });
        // `max_by_key` returns the last of equal offers: here the first one offered.
        let best = wanted.max_by_key(|(weight, precision, _)| (*weight, *precision));
        best.map(|(_, _, offer)| offer)
    }

    /// Returns the precision and the weight of a media type. The most precise matching range
    /// decides.
    fn weight_of(&self, media_type: &str) -> Option<(u8, u16)> {
        let ranges = self.ranges.iter();
        let matching =
            ranges.filter_map(|range| Some((range.precision(media_type)?, range.weight)));
        matching.max()
    }
}

impl MediaRange {
    fn parse(text: &str) -> Option<Self> {
        let mut parts = text.split(';').map(str::trim);
        let (main, sub) = parts.next()?.split_once('/')?;
        let is_token = |name: &str| {
            let mut characters = name.chars();
            !name.is_empty()
                && characters.all(|c| c.is_ascii_graphic() && !"\"(),/:<=>?@[]{}".contains(c))
        };
        if !is_token(main) || !is_token(sub) || main == "*" && sub != "*" {
            return None;
        }
        let mut weight = FULL_WEIGHT;
        for part in parts {
            if let Some((name, value)) = part.split_once('=')
                && name.eq_ignore_ascii_case("q")
            {
                weight = parse_weight(value)?;
            }
        }
        Some(Self {
            main: main.to_ascii_lowercase(),
            sub: sub.to_ascii_lowercase(),
            weight,
        })
    }

    /// Returns how precisely the range matches a media type; `None` if it does not match.
    fn precision(&self, media_type: &str) -> Option<u8> {
        let (main, sub) = media_type.split_once('/')?;
        match (self.main.as_str(), self.sub.as_str()) {
            ("*", "*") => Some(0),
            (own, "*") if own == main => Some(1),
            own if own == (main, sub) => Some(2),
            _ => None,
        }
    }
}

/// Parses `0`, `1`, or either with up to three decimals, into thousandths.
fn parse_weight(text: &str) -> Option<u16> {
    let (whole, decimals) = text.split_once('.').unwrap_or((text, ""));
    let is_short = decimals.len() <= 3 && decimals.bytes().all(|byte| byte.is_ascii_digit());
    if !is_short || !["0", "1"].contains(&whole) {
        return None;
    }
    let thousandths: u16 = format!("{whole}{decimals:0<3}").parse().ok()?;
    (thousandths <= FULL_WEIGHT).then_some(thousandths)
}

#[cfg(test)]
mod tests {
    use axum::http::HeaderValue;

    use super::*;

    const OFFERS: [(&str, &str); 4] = [
        ("json", "application/json"),
        ("jpeg", "image/jpeg"),
        ("png", "image/png"),
        ("geojson", "application/geo+json"),
    ];

    fn best(accept: &[&str]) -> Option<&'static str> {
        let mut headers = HeaderMap::new();
        for value in accept {
            headers.append(ACCEPT, HeaderValue::from_str(value).unwrap());
        }
        Accepted::from_headers(&headers).best_of(&OFFERS)
    }

    #[test]
    fn the_offer_with_the_largest_weight_wins() {
        for (accept, expected) in [
            ("image/png", Some("png")),
            ("IMAGE/Jpeg", Some("jpeg")),
            ("image/*", Some("jpeg")),
            ("image/*, image/jpeg;q=0.1", Some("png")),
            ("image/jpeg;q=0.5, image/png;q=0.501", Some("png")),
            ("image/jpeg;q=0, image/*", Some("png")),
            ("application/json, image/png;q=0.9", Some("json")),
            ("application/*;q=0.2, image/webp", Some("json")),
            ("image/webp, */*;q=0.1", Some("json")),
            ("application/geo+json", Some("geojson")),
            ("application/json;q=0, */*", Some("jpeg")),
            ("image/webp", None),
            ("text/html", None),
            ("*/*;q=0", None),
            ("application/json;q=0", None),
        ] {
            assert_eq!(best(&[accept]), expected, "{accept}");
        }
    }

    #[test]
    fn a_wildcard_selects_the_first_offer_and_a_name_wins() {
        assert_eq!(best(&[]), Some("json"));
        assert_eq!(best(&["*/*"]), Some("json"));
        assert_eq!(best(&["image/png, */*"]), Some("png"));
        assert_eq!(best(&["application/json, text/plain, */*"]), Some("json"));
        let browser = "text/html,application/xhtml+xml,application/xml;q=0.9,image/avif,*/*;q=0.8";
        assert_eq!(best(&[browser]), Some("json"));
        let img_element = "image/avif,image/webp,image/*,*/*;q=0.8";
        assert_eq!(best(&[img_element]), Some("jpeg"));
    }

    #[test]
    fn lines_are_combined_and_invalid_ranges_are_ignored() {
        assert_eq!(best(&["image/webp", "image/png"]), Some("png"));
        assert_eq!(best(&["nonsense, */json, image/png;q=2, ;"]), Some("json"));
        assert_eq!(best(&["nonsense, image/png"]), Some("png"));
        assert_eq!(best(&["image/png;q=1.001, image/jpeg;q=0.2"]), Some("jpeg"));
        assert_eq!(best(&["image/png;q=nan"]), Some("json"));
        assert_eq!(best(&["application/json;charset=utf-8"]), Some("json"));
    }

    #[test]
    fn weights_have_up_to_three_decimals() {
        for (text, weight) in [
            ("1", Some(1000)),
            ("1.000", Some(1000)),
            ("0", Some(0)),
            ("0.", Some(0)),
            ("0.25", Some(250)),
            ("0.001", Some(1)),
            ("0.0001", None),
            ("1.1", None),
            ("-0", None),
            ("", None),
            (".5", None),
        ] {
            assert_eq!(parse_weight(text), weight, "{text}");
        }
    }
}
