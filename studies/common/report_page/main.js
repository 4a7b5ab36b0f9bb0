// Puts the page together. `window.page` is there for whoever wants to drive it from outside, such as a test.
"use strict";

async function start() {
  const data = JSON.parse(document.getElementById("data").textContent);
  const player = await startPlayer(data);
  for (const table of data.curves) drawCurves(table, document.getElementById("curves"), player);
  const large = document.getElementById("large");
  for (const image of document.querySelectorAll("figure img")) {
    image.onclick = () => { large.querySelector("img").src = image.src; large.showModal(); };
  }
  large.onclick = () => large.close();
  window.page = { player };
}

start();
