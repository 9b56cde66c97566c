// Searches the built site by its own scripts: node search_in_node.cjs SITE < queries.json
"use strict";
const fs = require("fs");
const path = require("path");
const vm = require("vm");

const site = process.argv[2];
const empty = { lastChild: null };
const place = vm.createContext({
  SPHINX_HIGHLIGHT_ENABLED: false,
  document: { getElementById: () => empty, addEventListener: () => {}, readyState: "complete" },
  localStorage: { setItem: () => {} }, console, _ready: () => {}, _: (text) => text,
});
place.window = place;
const read = (name) => fs.readFileSync(path.join(site, name), "utf-8");
const page = read("search.html");
// the scripts that the page of the search loads, in its order
const scripts = [...page.matchAll(/<script src="([^"?]+)/g)].map((found) => found[1]);
const wanted = scripts.filter((name) => /language_data|stemmer|searchtools|scorer/.test(name));
const all = [...wanted, "searchindex.js"].map(read).join("\n");
vm.runInContext(`${all}
  var found = (query) => Search._performSearch(...Search._parseQuery(query)).map((one) => one[0]).reverse();`, place);
const queries = JSON.parse(fs.readFileSync(0, "utf-8"));
console.log(JSON.stringify(queries.map((query) => place.found(query))));
