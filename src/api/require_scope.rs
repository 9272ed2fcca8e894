//! Extractors that prove a scope: the only handlers without one are health checks, metrics and
//! documentation.

use std::marker::PhantomData;

use axum::{
    extract::FromRequestParts,
    http::{HeaderMap, request::Parts},
};

use lookdown_http::keys::basic_password;

use super::{
    ApiState,
    http::{access::Identity, context::RequestContext, problem::Problem},
};
use crate::access::{Holder, Scope};

/// Proof that the request has the scope of `S`.
pub(super) struct RequireScope<S>(PhantomData<S>);

/// Proof that the request may detect persons.
pub(super) type RequireDetect = RequireScope<Detect>;
/// Proof that the request may read calibrations and reports.
pub(super) type RequireRead = RequireScope<Read>;
/// Proof that the request may change the calibrations and the cameras of the server.
pub(super) type RequireAdmin = RequireScope<Admin>;

/// Proof that the request may see the images of views.
pub(super) type RequireView = RequireScope<View>;

/// A required scope.
pub(super) trait RequiredScope {
    /// The scope of the key.
    const SCOPE: Scope;
    /// `true` if a server without keys allows the request on its own machine only.
    const OWN_MACHINE_ONLY: bool;
}

/// Declares the required scopes: a name, its [`Scope`] and `OWN_MACHINE_ONLY`.
macro_rules! required_scopes {
    ($($name:ident = $scope:ident, $own_machine_only:literal;)+) => {$(
        #[doc = concat!("The marker of [`Require", stringify!($name), "`].")]
        pub(super) struct $name;

        impl RequiredScope for $name {
            const SCOPE: Scope = Scope::$scope;
            const OWN_MACHINE_ONLY: bool = $own_machine_only;
        }
    )+};
}

required_scopes! {
    Detect = Detect, false;
    Read = Read, false;
    Admin = Admin, true;
    View = View, false;
}

impl<S: RequiredScope> RequireScope<S> {
    fn check(state: &ApiState, headers: &HeaderMap, identity: &Identity) -> Result<Self, Problem> {
        let access = &state.options.access;
        if S::OWN_MACHINE_ONLY {
            access.check_of_its_own(headers, identity, S::SCOPE)?;
        } else {
            access.check(headers, identity, S::SCOPE)?;
        }
        Ok(Self(PhantomData))
    }

    /// Checks the scope of a request whose key may also be the password of Basic authentication, or
    /// `in_query`. Returns the holder of such a key.
    pub(super) fn with_key(
        state: &ApiState,
        headers: &HeaderMap,
        in_query: Option<&str>,
    ) -> Result<(Self, Option<Holder>), Problem> {
        let access = &state.options.access;
        let identity = access.identify(headers);
        let password = basic_password(headers);
        if S::OWN_MACHINE_ONLY {
            access.check_of_its_own(headers, &identity, S::SCOPE)?;
            return Ok((Self(PhantomData), None));
        }
        let elsewhere = in_query.or(password.as_deref());
        let holder = access.check_with(headers, &identity, elsewhere, S::SCOPE)?;
        Ok((Self(PhantomData), holder))
    }

    /// Checks the scope of a stream again: its key may have been removed.
    pub(super) fn check_again(state: &ApiState, headers: &HeaderMap) -> Result<Self, Problem> {
        Self::check(state, headers, &state.options.access.identify(headers))
    }
}

impl<S: RequiredScope> FromRequestParts<ApiState> for RequireScope<S> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        let context = RequestContext::from_extensions(&parts.extensions)?;
        Self::check(state, &parts.headers, &context.identity)
    }
}
