//! The parameters of a request as names and values.

use axum::{extract::Query, http::Uri};
use lookdown_detect::parameters::{ParameterError, ParameterSpec};

use super::problem::{Problem, ProblemKind};

/// Returns the names and values of the query parameters.
pub(in crate::api) fn query_parameters(uri: &Uri) -> Result<Vec<(String, String)>, Problem> {
    let pairs = Query::try_from_uri(uri).ok().map(|Query(pairs)| pairs);
    // The decoder replaces bytes that are not UTF-8 by this character.
    let is_text = |text: &String| !text.contains(char::REPLACEMENT_CHARACTER);
    pairs
        .filter(|pairs: &Vec<(String, String)>| {
            pairs
                .iter()
                .all(|(name, value)| is_text(name) && is_text(value))
        })
        .ok_or_else(|| {
            let detail = "the query cannot be read: send name=value&name=value, percent-encoded \
                          UTF-8";
            Problem::new(ProblemKind::MalformedRequest, detail)
        })
}

/// Returns the values of the named query parameters, each at most once.
pub(in crate::api) fn parameters_named<const COUNT: usize>(
    uri: &Uri,
    names: [&str; COUNT],
) -> Result<[Option<String>; COUNT], Problem> {
    values_named(query_parameters(uri)?, names)
}

/// Returns the values of the named parameters, each at most once.
pub(in crate::api) fn values_named<const COUNT: usize>(
    parameters: Vec<(String, String)>,
    names: [&str; COUNT],
) -> Result<[Option<String>; COUNT], Problem> {
    let mut values = [const { None }; COUNT];
    for (given, value) in parameters {
        let Some(index) = names.iter().position(|name| *name == given) else {
            let known = names.join(", ");
            let problem = format!("there is no such parameter; the parameters are {known}");
            return Err(ParameterError::unknown(&given, problem).into());
        };
        if values[index].replace(value).is_some() {
            return Err(ParameterError::repeated(&given).into());
        }
    }
    Ok(values)
}

/// Takes the parameters of a table out of those of a request.
pub(in crate::api) fn take(
    given: &mut Vec<(String, String)>,
    table: &[ParameterSpec],
) -> Vec<(String, String)> {
    let is_known = |name: &str| table.iter().any(|spec| spec.name == name);
    let taken = given.extract_if(.., |(name, _)| is_known(name));
    taken.collect()
}

/// Borrows the parameters of a request for a parser.
pub(in crate::api) fn pairs(given: &[(String, String)]) -> impl Iterator<Item = (&str, &str)> {
    given
        .iter()
        .map(|(name, value)| (name.as_str(), value.as_str()))
}
