//! What is said of a scene besides errors. Readers share it with their copies.

use crate::scene::json::Node;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Lines for the user.
#[derive(Debug, Clone, Default)]
pub struct Remarks(Arc<Mutex<[Texts; 2]>>);

/// Texts in the order in which they came, each with the place where it is true, and how many more such places there are.
#[derive(Debug, Default)]
struct Texts {
    texts: Vec<Text>,
    /// Which of them it is.
    index: HashMap<String, usize>,
}

#[derive(Debug)]
struct Text {
    text: String,
    first: String,
    last: String,
    others: usize,
}

impl Texts {
    fn add(&mut self, node: &Node, text: &str) {
        let place = format!("{}: {}", node.file.display(), node.path);
        if let Some(&known) = self.index.get(text) {
            let known = &mut self.texts[known];
            // Of what stands in many places at once it is not said again.
            known.others += usize::from(known.last != place);
            known.last = place;
        } else {
            self.index.insert(text.into(), self.texts.len());
            self.texts.push(Text { text: text.into(), first: place.clone(), last: place, others: 0 });
        }
    }

    fn lines(self) -> Vec<String> {
        let line = |Text { text, first, others, .. }| match others {
            0 => format!("{first}: {text}"),
            1 => format!("{first}, and in one more place: {text}"),
            n => format!("{first}, and in {n} more places: {text}"),
        };
        self.texts.into_iter().map(line).collect()
    }
}

impl Remarks {
    fn add(&self, kind: usize, node: &Node, text: &str) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)[kind].add(node, text);
    }

    /// Notes what is taken at this place.
    pub fn note(&self, node: &Node, text: &str) {
        self.add(0, node, text);
    }

    /// Warns of something at this place; `text` ends with the remedy.
    pub fn warn(&self, node: &Node, text: &str) {
        self.add(1, node, text);
    }

    /// All notes and all warnings, which are not kept.
    pub fn take(&self) -> [Vec<String>; 2] {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner)).map(Texts::lines)
    }
}
