//! Texts, addresses, paths, choices, lists and secrets.

use std::{fmt::Display, net::SocketAddr, path::PathBuf, str::FromStr};

use secrecy::SecretString;
use strum::VariantNames;
use toml::Value;
use url::Url;

use super::{Form, Refusal, Written};

/// A text that `read` parses to a value.
pub(in crate::settings) fn parsed<T: 'static>(
    kind: impl Into<String>,
    read: impl Fn(&str) -> Result<T, Refusal> + 'static,
    write: impl Fn(&T) -> String + 'static,
) -> Form<T> {
    let kind = kind.into();
    let remedy = format!("give a string: {kind}");
    Form::new(
        kind,
        move |written| match written.text() {
            Some(text) => read(text),
            None => Err(Refusal::Shown(remedy.clone())),
        },
        move |value| Value::String(write(value)),
    )
}

/// A text that `check` accepts.
pub(in crate::settings) fn text(
    kind: &'static str,
    check: impl Fn(&str) -> bool + 'static,
) -> Form<String> {
    parsed(
        kind,
        move |text| {
            let text = check(text).then(|| text.to_owned());
            text.ok_or_else(|| Refusal::Shown(format!("give {kind}")))
        },
        String::clone,
    )
}

/// An optional value; the empty text means none.
pub(in crate::settings) fn optional<T: 'static>(form: Form<T>) -> Form<Option<T>> {
    let (read, write) = (form.read, form.write);
    Form {
        kind: format!("{}, or empty", form.kind),
        read: Box::new(move |written| match written.text() {
            Some("") => Ok(None),
            _ => read(written).map(Some),
        }),
        write: Box::new(move |value| match value {
            Some(value) => write(value),
            None => Value::String(String::new()),
        }),
        example: form.example,
    }
}

/// An optional value of any simple type, as text; the empty text means none.
pub(in crate::settings) fn optional_text(
    kind: String,
    read: impl Fn(&str) -> Result<String, Refusal> + 'static,
) -> Form<Option<String>> {
    let remedy = format!("give {kind}");
    let form = Form::new(
        kind,
        move |written| match written {
            Written::Variable(text) => read(text),
            Written::Toml(Value::String(text)) => read(text),
            Written::Toml(value @ (Value::Boolean(_) | Value::Integer(_) | Value::Float(_))) => {
                read(&value.to_string())
            }
            Written::Toml(_) => Err(Refusal::Shown(remedy.clone())),
        },
        |text: &String| Value::String(text.clone()),
    );
    optional(form)
}

/// An address with a port.
pub(in crate::settings) fn address() -> Form<SocketAddr> {
    parsed(
        "IP address and port",
        |text| {
            // A name is not looked up, because it may stand for several addresses.
            let ip = text
                .strip_prefix("localhost:")
                .map(|port| format!("127.0.0.1:{port}"));
            ip.as_deref().unwrap_or(text).parse().map_err(|_| {
                let remedy = "give an IP address and a port, such as 127.0.0.1:8080 or [::]:8080";
                Refusal::Shown(remedy.to_owned())
            })
        },
        SocketAddr::to_string,
    )
}

/// A URL of HTTP.
pub(in crate::settings) fn web_address() -> Form<Url> {
    parsed(
        "URL",
        |text| {
            let url = text.parse::<Url>().ok();
            let url = url.filter(|url| matches!(url.scheme(), "http" | "https"));
            url.ok_or_else(|| {
                Refusal::Shown("give an address such as http://lookdown.local:8080".to_owned())
            })
        },
        Url::to_string,
    )
}

/// The path of a file or folder.
pub(in crate::settings) fn path() -> Form<PathBuf> {
    parsed(
        "path",
        |text| {
            if text.contains("-----BEGIN") {
                // It may be a private key.
                let problem = "it is PEM text: write that to a file and give the path of the file";
                return Err(Refusal::Hidden(problem.to_owned()));
            }
            if text.is_empty() {
                let remedy = "give a path, or leave the key out";
                return Err(Refusal::Shown(remedy.to_owned()));
            }
            if text.contains("://") {
                // It may hold a password.
                let remedy = "give a path on this machine, and mount other storage as a volume";
                return Err(Refusal::Part("a URL".to_owned(), remedy.to_owned()));
            }
            Ok(PathBuf::from(text))
        },
        |path| path.display().to_string(),
    )
}

/// An optional path, without a key for none. An empty path is refused: by mistake it would disable
/// a feature. `example` appears in the settings file.
pub(in crate::settings) fn given_path(example: &'static str) -> Form<Option<PathBuf>> {
    let mut form = path().map(Some, |path| path.clone().unwrap_or_default());
    form.example = Some(example);
    form
}

/// One of several names.
pub(in crate::settings) fn choice<T: Copy + PartialEq + 'static>(
    choices: &'static [(&'static str, T)],
) -> Form<T> {
    let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
    one_of(
        &names,
        |text| {
            let chosen = choices.iter().find(|(name, _)| *name == text);
            chosen.map(|(_, choice)| *choice)
        },
        |value| {
            let mut choices = choices.iter();
            let name = choices.find_map(|(name, choice)| (choice == value).then_some(*name));
            name.unwrap_or_default().to_owned()
        },
    )
}

/// One of the names of an enum.
pub(in crate::settings) fn variant<T: FromStr + Display + VariantNames + 'static>() -> Form<T> {
    one_of(T::VARIANTS, |text| text.parse().ok(), T::to_string)
}

fn one_of<T: 'static>(
    names: &[&str],
    read: impl Fn(&str) -> Option<T> + 'static,
    write: impl Fn(&T) -> String + 'static,
) -> Form<T> {
    let remedy = format!("use one of {}", names.join(", "));
    let kind: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
    parsed(
        kind.join(" or "),
        move |text| read(text).ok_or_else(|| Refusal::Shown(remedy.clone())),
        write,
    )
}

/// A list of texts that `read` parses: an array in TOML, separated by commas in a variable.
pub(in crate::settings) fn list<T: 'static>(
    items: &'static str,
    read: impl Fn(&[&str]) -> Result<T, Refusal> + 'static,
    write: impl Fn(&T) -> Vec<String> + 'static,
) -> Form<T> {
    Form::new(
        format!("array of {items}"),
        move |written| {
            let texts: Option<Vec<&str>> = match written {
                Written::Variable(text) => {
                    let texts = text.split(',').map(str::trim);
                    Some(texts.filter(|text| !text.is_empty()).collect())
                }
                Written::Toml(Value::Array(values)) => values.iter().map(Value::as_str).collect(),
                Written::Toml(_) => None,
            };
            // The value is not repeated: it may hold an API key.
            let texts = texts.ok_or_else(|| {
                let remedy =
                    format!("it must be an array of {items}, such as [\"a\", \"b\"] or []");
                Refusal::Hidden(remedy)
            })?;
            read(&texts)
        },
        move |value| Value::Array(write(value).into_iter().map(Value::String).collect()),
    )
}

/// A list of names.
pub(in crate::settings) fn names() -> Form<Vec<String>> {
    let owned = |names: &[&str]| Ok(names.iter().map(|&name| name.to_owned()).collect());
    list("names", owned, Vec::clone)
}

/// A text that no message and no log line shows. The empty text means none.
pub(in crate::settings) fn secret(kind: &'static str) -> Form<Option<SecretString>> {
    Form::new(
        format!("{kind}, or empty"),
        move |written| match written.text() {
            Some(text) => Ok((!text.is_empty()).then(|| SecretString::from(text))),
            None => Err(Refusal::Hidden(format!("it must be a string: {kind}"))),
        },
        // A default is never a secret.
        |_| Value::String(String::new()),
    )
}
