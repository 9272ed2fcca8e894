//! Listings of buckets without the entries whose names are refused. The provider's client refuses a
//! whole page for one name with empty or relative parts.

use std::borrow::Cow;

use object_store::path::Path;
use serde::Deserialize;

/// Elements of objects and of prefixes, of S3 and Google Cloud Storage and of Azure.
const ENTRIES: [&str; 4] = ["Contents", "CommonPrefixes", "Blob", "BlobPrefix"];

/// The part of an entry that decides.
#[derive(Deserialize)]
struct Entry {
    #[serde(rename = "Key", alias = "Prefix", alias = "Name")]
    name: String,
}

/// A listing, and the number of entries that it lost.
pub(super) struct Usable<'a> {
    pub(super) listing: Cow<'a, str>,
    pub(super) refused: usize,
}

/// Returns the listing without the entries whose names are refused.
pub(super) fn usable(listing: &str) -> Usable<'_> {
    let (mut kept, mut refused) = (String::new(), 0);
    let (mut copied, mut from) = (0, 0);
    while let Some((start, end)) = next_entry(listing, from) {
        if !is_usable(&listing[start..end]) {
            kept.push_str(&listing[copied..start]);
            copied = end;
            refused += 1;
        }
        from = end;
    }
    if refused == 0 {
        return Usable {
            listing: Cow::Borrowed(listing),
            refused,
        };
    }
    kept.push_str(&listing[copied..]);
    Usable {
        listing: Cow::Owned(kept),
        refused,
    }
}

/// Returns the range of the first entry after `from`. In texts, `<` is always escaped.
fn next_entry(listing: &str, mut from: usize) -> Option<(usize, usize)> {
    loop {
        let start = from + listing[from..].find('<')?;
        let tag = &listing[start + 1..];
        let is_tag = |name: &&&str| {
            let rest = tag.strip_prefix(**name);
            rest.is_some_and(|rest| rest.starts_with('>'))
        };
        if let Some(name) = ENTRIES.iter().find(is_tag) {
            let end_tag = format!("</{name}>");
            let end = start + listing[start..].find(&end_tag)? + end_tag.len();
            return Some((start, end));
        }
        from = start + 1;
    }
}

fn is_usable(entry: &str) -> bool {
    let entry = quick_xml::de::from_str::<Entry>(entry);
    entry.is_ok_and(|entry| Path::parse(entry.name).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_with_refused_names_are_left_out() {
        let object = |name: &str| {
            format!(
                "<Contents><Key>c/{name}</Key><Size>1</Size><Owner><ID>1</ID></Owner></Contents>"
            )
        };
        let prefix =
            |name: &str| format!("<CommonPrefixes><Prefix>{name}</Prefix></CommonPrefixes>");
        let page = |entries: &[String]| {
            let entries = entries.concat();
            format!(
                "<ListBucketResult><Prefix>c/</Prefix>{entries}<IsTruncated>false</IsTruncated></ListBucketResult>"
            )
        };
        let good = [
            object("lobby.json"),
            object("a &amp; b.json"),
            prefix("c/old/"),
        ];
        let refused = [
            "..",
            ".",
            "a/../b",
            "a//b",
            "a&#10;b",
            "a&#x1;b",
            "&unknown;",
        ]
        .map(object);
        let refused = [&refused[..], &["c//", "c/../", "c/./"].map(prefix)].concat();
        let mixed: Vec<_> = refused[..4]
            .iter()
            .chain(&good[..1])
            .chain(&refused[4..])
            .chain(&good[1..])
            .cloned()
            .collect();
        let page_of_all = page(&mixed);
        let found = usable(&page_of_all);
        assert_eq!(found.listing, page(&good));
        assert_eq!(found.refused, refused.len());
        let page_of_good = page(&good);
        assert!(matches!(usable(&page_of_good).listing, Cow::Borrowed(_)));
    }

    #[test]
    fn listings_of_azure_are_filtered_too() {
        let blob = |name: &str| {
            format!("<Blob><Name>{name}</Name><Properties><Etag>1</Etag></Properties></Blob>")
        };
        let page = |blobs: &str| {
            format!("<EnumerationResults><Blobs>{blobs}</Blobs><NextMarker /></EnumerationResults>")
        };
        let good = blob("lobby.json");
        let prefix = "<BlobPrefix><Name>a/../</Name></BlobPrefix>";
        let mixed = page(&(blob("a//b") + &good + prefix));
        assert_eq!(usable(&mixed).listing, page(&good));
    }

    #[test]
    fn texts_that_are_not_listings_stay_as_they_are() {
        for text in [
            "",
            "<",
            "<Contents>",
            "<Blob></Blob",
            "é<Contents><Key>a</Key>",
        ] {
            let found = usable(text);
            assert_eq!((&*found.listing, found.refused), (text, 0));
        }
    }
}
