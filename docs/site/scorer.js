// How the search of the site orders pages: as Sphinx does, but long lists, which have every word,
// come after pages that explain.
var Scorer = {
  score: ([page, , , , score]) => score - (/^(reference\/|parameters$|glossary$)/.test(page) ? 8 : 0),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
