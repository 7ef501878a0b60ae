"use strict";
// Plotly's figures, drawn once from the data in the page; pictures in their own size by a click.
(() => {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const options = { displaylogo: false, responsive: true };

  function scalable(place) { // as a picture, to whatever width paper has
    for (const drawn of place.querySelectorAll(".main-svg")) {
      const [width, height] = [drawn.getAttribute("width"), drawn.getAttribute("height")];
      drawn.setAttribute("viewBox", `0 0 ${width} ${height}`);
      place.style.setProperty("--shape", `${width} / ${height}`);
    }
  }

  for (const [key, figure] of Object.entries(figures)) {
    const place = document.getElementById(key);
    Plotly.newPlot(place, figure.data, figure.layout, options);
    place.on("plotly_afterplot", () => scalable(place));
    scalable(place);
  }
  for (const image of document.querySelectorAll(".picture img")) {
    image.classList.add("able");
    image.addEventListener("click", () => image.classList.toggle("whole"));
  }
})();
