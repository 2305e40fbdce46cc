// The text's section 7 without ROS: an ONNX network in OpenCV's DNN module, read as NCHW, and the target's cloud.
//
// segment NETWORK IMAGE DEPTH CALIBRATION WIDTH HEIGHT TARGET MASK CLOUD
//   DEPTH: 16-bit PNG, millimetres. CALIBRATION: text, 9 numbers of K and 16 of T_base_cam, row by row.
//   WIDTH, HEIGHT: of the blob. MASK: PNG to write. CLOUD: float64 x y z to write, in the image's reading order.

#include <fstream>
#include <iostream>
#include <string>

#include <opencv2/dnn.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

static cv::Mat label(cv::dnn::Net& net, const cv::Mat& bgr, cv::Size size) {
    net.setInput(cv::dnn::blobFromImage(bgr, 1.0 / 255.0, size, cv::Scalar(), /*swapRB=*/true, /*crop=*/false));
    const cv::Mat scores = net.forward();  // (1, C, H, W): one whole image a class
    const int C = scores.size[1], H = scores.size[2], W = scores.size[3];
    cv::Mat mask(H, W, CV_8UC1);
    for (int v = 0; v < H; ++v) {
        for (int u = 0; u < W; ++u) {
            int best = 0;
            for (int c = 1; c < C; ++c) {
                if (scores.ptr<float>(0, c)[v * W + u] > scores.ptr<float>(0, best)[v * W + u]) best = c;
            }
            mask.at<uchar>(v, u) = static_cast<uchar>(best);
        }
    }
    cv::resize(mask, mask, bgr.size(), 0, 0, cv::INTER_NEAREST);
    return mask;
}

int main(int argc, char** argv) {
    if (argc != 10) {
        std::cerr << "segment NETWORK IMAGE DEPTH CALIBRATION WIDTH HEIGHT TARGET MASK CLOUD\n";
        return 2;
    }
    cv::dnn::Net net = cv::dnn::readNetFromONNX(argv[1]);
    const cv::Mat bgr = cv::imread(argv[2]), depth = cv::imread(argv[3], cv::IMREAD_UNCHANGED);
    std::ifstream calibration(argv[4]);
    cv::Matx33d K;
    cv::Matx44d T_base_cam;
    for (double& x : K.val) calibration >> x;
    for (double& x : T_base_cam.val) calibration >> x;
    if (bgr.empty() || depth.type() != CV_16UC1 || depth.size() != bgr.size() || !calibration) {
        std::cerr << "expected an image, a 16-bit depth image of its size, and 25 numbers\n";
        return 2;
    }
    const cv::Mat mask = label(net, bgr, cv::Size(std::stoi(argv[5]), std::stoi(argv[6])));
    cv::imwrite(argv[8], mask);

    const int target = std::stoi(argv[7]);
    const cv::Matx33d K_inverse = K.inv();
    std::ofstream cloud(argv[9], std::ios::binary);
    for (int v = 0; v < mask.rows; ++v) {
        for (int u = 0; u < mask.cols; ++u) {
            const double d = depth.at<ushort>(v, u) * 0.001;
            if (mask.at<uchar>(v, u) != target || d <= 0.0) continue;  // 0 is "no reading"
            const cv::Vec3d P_cam = d * (K_inverse * cv::Vec3d(u, v, 1.0));
            const cv::Vec4d P_base = T_base_cam * cv::Vec4d(P_cam[0], P_cam[1], P_cam[2], 1.0);
            cloud.write(reinterpret_cast<const char*>(P_base.val), 3 * sizeof(double));
        }
    }
    return cloud ? 0 : 1;
}
