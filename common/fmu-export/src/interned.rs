//! Texts that live as long as the process, for variable tables that are made while it runs. Each text is kept once, so
//! that making the same table again takes no more room.

use std::collections::HashSet;
use std::sync::{LazyLock, Mutex, PoisonError};

use model::{EnumType, Item};

/// Kept values of one type.
type Kept<T> = LazyLock<Mutex<HashSet<&'static T>>>;

static TEXTS: Kept<str> = LazyLock::new(Mutex::default);
static LISTS: Kept<[&'static str]> = LazyLock::new(Mutex::default);
static TYPES: Mutex<Vec<&'static EnumType>> = Mutex::new(Vec::new());

/// The kept value that equals `value`, otherwise what `keep` makes.
fn kept<T: ?Sized + std::hash::Hash + Eq>(
    store: &Kept<T>,
    value: &T,
    keep: impl FnOnce() -> &'static T,
) -> &'static T {
    let mut store = store.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = store.get(value) {
        return known;
    }
    let new = keep();
    store.insert(new);
    new
}

/// The same text for the rest of the process.
#[must_use]
pub fn text(text: &str) -> &'static str {
    kept(&TEXTS, text, || String::leak(text.into()))
}

/// The same list of texts for the rest of the process.
#[must_use]
pub fn list(texts: &[String]) -> &'static [&'static str] {
    let texts: Vec<_> = texts.iter().map(|t| text(t)).collect();
    kept(&LISTS, &texts[..], || Vec::leak(texts.clone()))
}

/// An enumeration type for the rest of the process, from its name and the names, numbers and meanings of its items.
#[must_use]
pub fn enumeration(name: &str, description: &str, items: &[(String, i64, String)]) -> &'static EnumType {
    let item = |(name, value, meaning): &(String, i64, String)| Item {
        name: text(name),
        value: *value,
        description: text(meaning),
    };
    let items: Vec<_> = items.iter().map(item).collect();
    let mut types = TYPES.lock().unwrap_or_else(PoisonError::into_inner);
    let same = |known: &&&'static EnumType| {
        known.name == name && known.description == description && known.items == items
    };
    if let Some(known) = types.iter().find(same) {
        return known;
    }
    let new = Box::leak(Box::new(EnumType {
        name: text(name),
        description: text(description),
        items: Vec::leak(items),
    }));
    types.push(new);
    new
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_texts_are_kept_once() {
        let (a, b) = (text(&String::from("upper.mass")), text(&String::from("upper.mass")));
        assert!(std::ptr::eq(a, b));
        let lists = [list(&["a".into(), "b".into()]), list(&["a".into(), "b".into()])];
        assert!(std::ptr::eq(lists[0], lists[1]) && lists[0] == ["a", "b"]);
        let items = [("one".to_owned(), 1, String::new())];
        assert!(std::ptr::eq(enumeration("T", "", &items), enumeration("T", "", &items)));
        assert_ne!(enumeration("T", "", &items).items, enumeration("T", "", &[]).items);
    }
}
