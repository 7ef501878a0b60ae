"use strict";
// Plotly's figures, drawn once from the data in the page; pictures in their own size by a click.
(() => {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const options = { displaylogo: false, responsive: true };
  for (const [key, figure] of Object.entries(figures)) {
    Plotly.newPlot(document.getElementById(key), figure.data, figure.layout, options);
  }
  for (const image of document.querySelectorAll(".picture img")) {
    image.classList.add("able");
    image.addEventListener("click", () => image.classList.toggle("whole"));
  }
})();
