//! Who may do what: with keys, whoever shows one with the scope; without, all who can reach the
//! server may find and read, and its own machine alone may change it.

use std::sync::Arc;

use axum::{
    extract::FromRequestParts,
    http::{HeaderMap, HeaderName, HeaderValue, header::AUTHORIZATION, request::Parts},
};

use super::{
    ApiState,
    problem::{Problem, ProblemKind},
};
use crate::access::{AccessKeys, Holder, Scope};

/// The header of a key alone.
pub(super) const API_KEY: HeaderName = HeaderName::from_static("x-api-key");
const BEARER: &[u8] = b"bearer ";

/// Who may do what.
#[derive(Debug, Clone)]
pub enum Access {
    /// There are no keys.
    Open {
        /// Whether only the server's own machine reaches it, and may change it therefore.
        own_machine_only: bool,
    },
    /// Every request shows a key.
    Keys(Arc<AccessKeys>),
}

/// Whoever sent the request may find persons.
pub(super) struct Finder;

/// Whoever sent the request may read calibrations and reports.
pub(super) struct Reader;

/// Whoever sent the request may list models, which tells of files of the server's machine.
pub(super) struct ModelReader;

/// Whoever sent the request may change the models and the calibrations of the server.
pub(super) struct Administrator;

impl FromRequestParts<ApiState> for Finder {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        state.options.access.check(&parts.headers, Scope::Detect)?;
        Ok(Self)
    }
}

impl FromRequestParts<ApiState> for Reader {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        Self::check(state, &parts.headers)
    }
}

impl FromRequestParts<ApiState> for ModelReader {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        let access = &state.options.access;
        access.check_of_its_own(&parts.headers, Scope::Read)?;
        Ok(Self)
    }
}

impl FromRequestParts<ApiState> for Administrator {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        let access = &state.options.access;
        access.check_of_its_own(&parts.headers, Scope::Admin)?;
        Ok(Self)
    }
}

impl Reader {
    /// Whether whoever sent these headers may read now. Keys go, also while their holders listen.
    pub(super) fn check(state: &ApiState, headers: &HeaderMap) -> Result<Self, Problem> {
        state.options.access.check(headers, Scope::Read)?;
        Ok(Self)
    }
}

impl Access {
    /// Whether the request with these headers may do what `wanted` opens, as far as keys decide.
    pub(super) fn check(&self, headers: &HeaderMap, wanted: Scope) -> Result<(), Problem> {
        self.check_with(headers, None, wanted)
    }

    /// The same for a request that may show its key in a form.
    pub(super) fn check_with(
        &self,
        headers: &HeaderMap,
        in_form: Option<&str>,
        wanted: Scope,
    ) -> Result<(), Problem> {
        let Self::Keys(keys) = self else {
            return Ok(());
        };
        let key = only_key(shown_keys(headers).chain(in_form.map(str::as_bytes)))?;
        let holder = keys.holder_of(key).ok_or_else(|| {
            let detail = "the key is not known here: it was mistyped, or the server's operator \
                          has removed it";
            Problem::new(ProblemKind::KeyRequired, detail)
        })?;
        if holder.scopes.allow(wanted) {
            return Ok(());
        }
        let detail = format!(
            "the key {} has the scope {}: this needs a key with the scope {wanted}",
            holder.name,
            holder.scopes.joined(" and "),
        );
        Err(Problem::new(ProblemKind::Forbidden, detail))
    }

    /// Whether every request shows a key.
    pub(super) fn needs_keys(&self) -> bool {
        matches!(self, Self::Keys(_))
    }

    /// Whose key the request with these headers shows, if it shows one that is known.
    pub(super) fn holder(&self, headers: &HeaderMap) -> Option<Holder> {
        match self {
            Self::Open { .. } => None,
            Self::Keys(keys) => keys.holder_of(only_key(shown_keys(headers)).ok()?),
        }
    }

    /// The same for what is open to nobody but the server's own machine where there are no keys.
    fn check_of_its_own(&self, headers: &HeaderMap, wanted: Scope) -> Result<(), Problem> {
        match self {
            Self::Open {
                own_machine_only: false,
            } => {
                let detail = "without keys (access.keys_file), models and calibrations are \
                              changed on the server's own machine only: this server listens to \
                              others, too (server.listen)";
                Err(Problem::new(ProblemKind::Forbidden, detail))
            }
            _ => self.check(headers, wanted),
        }
    }
}

/// Whether these headers show a key, of whomever.
pub(super) fn shows_key(headers: &HeaderMap) -> bool {
    shown_keys(headers).next().is_some()
}

/// The keys in the headers. Another scheme of `Authorization` is for somebody else on the way.
fn shown_keys(headers: &HeaderMap) -> impl Iterator<Item = &[u8]> {
    let bearers = headers.get_all(AUTHORIZATION).iter().filter_map(|value| {
        let (scheme, key) = value.as_bytes().split_at_checked(BEARER.len())?;
        scheme
            .eq_ignore_ascii_case(BEARER)
            .then(|| key.trim_ascii())
    });
    let plain = headers.get_all(API_KEY).iter();
    bearers.chain(plain.map(HeaderValue::as_bytes))
}

/// The one key of a request.
fn only_key<'a>(mut keys: impl Iterator<Item = &'a [u8]>) -> Result<&'a [u8], Problem> {
    match (keys.next(), keys.next()) {
        (Some(key), None) => Ok(key),
        (None, _) => Err(Problem::new(
            ProblemKind::KeyRequired,
            "this needs a key: send it as Authorization: Bearer KEY or as X-API-Key: KEY",
        )),
        (Some(_), Some(_)) => Err(Problem::new(
            ProblemKind::KeyRequired,
            "more than one key was sent: send one, as Authorization: Bearer KEY or as X-API-Key: \
             KEY",
        )),
    }
}
