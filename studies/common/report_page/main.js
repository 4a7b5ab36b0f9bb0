// Puts the page together. `window.page` is there for whoever wants to drive it from outside, such as a test.
"use strict";

async function start() {
  const data = JSON.parse(document.getElementById("data").textContent);
  const movies = [];
  for (const movie of data.movies) movies.push(await readMovie(movie));
  const player = movies.length ? new Player(data, movies) : null;
  for (const table of data.curves) drawCurves(table, document.getElementById("curves"), player);
  const large = document.getElementById("large");
  for (const image of document.querySelectorAll("figure img")) {
    image.onclick = () => { large.querySelector("img").src = image.src; large.showModal(); };
  }
  large.onclick = () => large.close();
  if (player) player.show(player.times.at(-1));
  window.page = { player };
}

start().catch((error) => {
  const note = document.createElement("p");
  note.className = "problem";
  note.textContent = `The moving picture cannot be shown: ${error.message}. A browser from 2023 or later is needed.`;
  document.querySelector("main").prepend(note);
  throw error;
});
