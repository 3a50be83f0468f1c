#include <chrono>
#include "drv.hpp"
void setrate(Scene& s,const Structure& S,double per=0.4){s.rate=std::clamp(S.omega.maxCoeff()/per,20*lowest_of(S)/6.28,20000.0);}
std::string S(double x){char b[40];std::snprintf(b,40,"%.4g",x);return b;}
double size_of(const Structure& s){return s.mass_properties.r.colwise().norm().maxCoeff();}
Scene cloud(int n,unsigned seed,double lo=1e3,double hi=1e4){std::mt19937_64 g(seed);std::uniform_real_distribution<double>u(-1,1);Scene s;s.name="cl";
  while((int)s.points.size()<n){Vector3d p(1.5*u(g),0.8*u(g),0.6*u(g));bool ok=true;for(auto&q:s.points)ok=ok&&(q.position-p).norm()>0.6;if(ok)point(s,std::exp(0.7*u(g)),p);}
  for(int a=0;a<n;++a)for(int b=a+1;b<n;++b)link(s,{a,b},Spring{std::exp(0.5*(std::log(lo)+std::log(hi))+0.5*u(g)*std::log(hi/lo))});publish_all(s);return s;}
Eigen::Matrix3d axes(const Scene& s,const Structure& S_){Eigen::Matrix3d J=Eigen::Matrix3d::Zero();const auto& r=S_.mass_properties.r;
    for(int i=0;i<r.cols();++i)J+=s.points[i].mass*(r.col(i).squaredNorm()*Eigen::Matrix3d::Identity()-r.col(i)*r.col(i).transpose());
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> es(J);std::printf("J %.3g %.3g %.3g ",es.eigenvalues()[0],es.eigenvalues()[1],es.eigenvalues()[2]);return es.eigenvectors();}
// attitude: stable spins, world force constant, no unstable axis
TEST(F,stable){for(unsigned seed:{0u,1u})for(int ax:{0,2})for(double tilt:{0.0,0.3}){Scene s=cloud(5,seed+200);s.damping.modal_ratio=0.05;auto S_=st(s);double w1=lowest_of(*S_);setrate(s,*S_,0.8);
    auto E=axes(s,*S_);s.initial.angular_velocity=0.02*w1*(E.col(ax)+tilt*E.col(1));
    study("spin-loaded stable seed"+S(seed)+" axis "+S(ax)+" tilt "+S(tilt),s,80/(0.02*w1),{Fidelity::kSpinLoaded,Fidelity::kCoupled},25);}}
TEST(F,worldpush){for(unsigned seed:{0u,1u,2u}){Scene s=cloud(5,seed+200);s.damping.modal_ratio=0.05;auto S_=st(s);double w1=lowest_of(*S_);setrate(s,*S_,0.8);double z=size_of(*S_);
    // pulled through the centre of mass and a point: stable or unstable attitude, no turn but by deformation
    int p=0;Vector3d d=S_->mass_properties.r.col(p).normalized();Load L;L.axes=Axes::kWorld;double F=2e-4*S_->mass_properties.mass*w1*w1*z;L.forces={{p,-F*d}};s.loads={L};
    study("world push through the centre seed"+S(seed),s,60*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kSpinLoaded,Fidelity::kCoupled},25);}}
TEST(F,attractor){for(unsigned seed:{0u,1u}){Scene s=cloud(5,seed+200);s.damping.modal_ratio=0.05;auto S_=st(s);double w1=lowest_of(*S_);setrate(s,*S_,0.8);double z=size_of(*S_);
    auto E=axes(s,*S_);double R=3000*z,n=0.02*w1;s.attractor.mu=n*n*R*R*R;
    // unstable: the axis of least inertia along the orbit
    Eigen::Matrix3d A;A.col(0)=E.col(1);A.col(1)=E.col(0);A.col(2)=A.col(0).cross(A.col(1));
    // place: attractor at -R along col(0)
    Vector3d cm=Vector3d::Zero();double M=0;for(auto&p:s.points){cm+=p.mass*p.position;M+=p.mass;}cm/=M;
    s.attractor.position=cm-R*A.col(0);s.initial.velocity=n*R*A.col(1);s.initial.angular_velocity=n*A.col(2);
    study("attractor seed"+S(seed),s,25/n,{Fidelity::kSpinLoaded,Fidelity::kCoupled},25);}}
// frames of beams and plates with one soft member
TEST(F,frame){for(unsigned seed=0;seed<6;++seed){std::mt19937_64 g(seed+50);std::uniform_real_distribution<double>u(-1,1);Scene s;s.name="fr";
    for(int i=0;i<5;++i)point(s,std::exp(u(g)),Vector3d(i,0.6*u(g),0.6*u(g)));
    int soft=seed%4;for(int i=0;i<4;++i){double EI=300*(i==soft?0.005:1);link(s,{i,i+1},Beam{.EA=3e4,.GJ=0.6*EI,.EI_y=EI,.EI_z=1.2*EI,.y_axis=Vector3d(0.1,0.2,1)});}
    if(seed>=4){s.links.clear();double t=0.02;for(int i=0;i<3;++i)link(s,{i,i+1,i+2},Plate{.E=12.*200*(i==1?0.02:1)/(t*t*t)*0.05,.nu=0.3,.thickness=t});}
    publish_all(s);auto S_=st(s);if(!S_)continue;double w1=lowest_of(*S_);setrate(s,*S_,0.8);int a=S_->mechanisms.size();std::printf("w ");for(int k=0;k<6&&k<S_->omega.size();++k)std::printf("%.3g ",S_->omega[k]);
    add_mode(s,*S_,a+3,1e-3,0);add_mode(s,*S_,a+4,5e-4,0);
    study("frame seed"+S(seed),s,4*2*M_PI/w1,{Fidelity::kSeparated,Fidelity::kCoupled},25);}}
TEST(F,hammer){for(double share:{8.,16.}){Scene s;s.name="s";for(int i=0;i<4;++i)point(s,1,Vector3d(i,0,0));for(int i=0;i<3;++i)link(s,{i,i+1},Spring{3e5});for(int i=0;i<2;++i)link(s,{i,i+1,i+2},BendingSpring{100});publish_all(s);
    auto S_=st(s);double w1=lowest_of(*S_);s.rate=20000;add_mode(s,*S_,0,1e-3,0);s.damping.mode_ratios={};Load L;L.axes=Axes::kBody;double F=share*200;L.forces={{0,Vector3d(F,0,0)},{3,Vector3d(-F,0,0)}};L.history=PulseHistory{0.1,1/s.rate};s.loads={L};
    study("hammer share "+S(share),s,2*M_PI/w1,{Fidelity::kSeparated},20000*2*M_PI/w1/4);}}
TEST(Z,tally){std::printf("TALLY scenes %d runs %d runs with false %d words %d good %d false %d silly runs %d\n",tally.scenes,tally.runs,tally.runs_fg,tally.words,tally.good,tally.false_good,tally.silly);}
